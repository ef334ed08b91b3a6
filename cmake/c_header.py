"""What generators read of cumulet.h: its structs and enums, without comments. The header's style is all that is understood."""
import re


def read(path):
    with open(path, encoding="utf-8") as file:
        return re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)


def types(kind, text):
    """Name and body of each `typedef struct` or `typedef enum`, in order."""
    return re.findall(rf"typedef {kind} (\w+) \{{(.*?)\}} \1;", text, flags=re.S)
