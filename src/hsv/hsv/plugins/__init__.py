"""Foreign code and code for others: controllers by name, C libraries, FMUs both ways, and export in C99."""
