"""`python -m pyroshock`: the command line, where the program `pyroshock` is not on the PATH."""

import sys

if __name__ == "__main__":
    if not sys.flags.safe_path:
        del sys.path[
            0
        ]  # the working directory, which Python has put there: before anything is imported from it
    from pyroshock.app.doors.command_line.main import main

    main(prog_name="pyroshock")
