"""The program `curling` from its first moment to its last.

Loading the packages takes half a second, and Python another moment to end. An interrupt then is
answered as in between: in one line, and not after the result has been written.
"""

import signal
import sys

INTERRUPTED = 130
"""Exit status, as shells report SIGINT."""


def main() -> int:
    """Run `curling` with the arguments of the process."""
    try:
        from curling_env.commands import cli

        return cli.main()
    except KeyboardInterrupt:
        if sys.stderr is not None:
            reason = "curling: interrupted; nothing was written; repeat the command to start again"
            print(reason, file=sys.stderr)
        return INTERRUPTED
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done


if __name__ == "__main__":
    sys.exit(main())
