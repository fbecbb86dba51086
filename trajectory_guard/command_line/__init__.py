"""
The command line: files and bags in, a report or JSON out.

A shell: it reads, calls the core and prints. What takes long to import is imported when a command
needs it, so that help and usage errors are quick.
"""
