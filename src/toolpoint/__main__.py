"""`python -m toolpoint` is the command line."""

from toolpoint.app.entry import main

main()
