"""Reads the structs and enums of cumulet.h, without comments, for the generators. It understands only that header's
style."""
import re


def read(path):
    with open(path, encoding="utf-8") as file:
        return re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)


def types(kind, text):
    """Returns the name and the body of each `typedef struct` or `typedef enum`, in order."""
    return re.findall(rf"typedef {kind} (\w+) \{{(.*?)\}} \1;", text, flags=re.S)
