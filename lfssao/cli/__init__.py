"""The command line: ``main`` parses it and imports the file of the command that is given.

``job_options`` has the options that ``render`` and ``plan`` share, ``values`` the types of options, ``terminal`` words
and exit codes; any other file is a command.
"""
