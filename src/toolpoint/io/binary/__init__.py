"""Binary containers as bare arrays and columns; what can hang or crash is read in a process of its own."""
