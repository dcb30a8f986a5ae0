"""`python -m toolpoint` is the command line."""

from toolpoint.app.main import main

main()
