"""Language of programs: expressions, words, statements, and the interpreter that runs jumps, loops and subprograms."""
