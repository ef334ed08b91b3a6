// The programs that make precompiled headers compile this file; the headers are listed in CMakeLists.txt.
int main() { return 0; }
