"""Commands of the package: `gestell live machine.nml`, or `python3 -m gestell live machine.nml`."""
from __future__ import annotations

import argparse
import signal
import sys
import webbrowser

from . import Error
from .live import PORT, Server


def main(arguments: list | None = None) -> int:
    parser = argparse.ArgumentParser(prog="gestell", description="Tools of the Python package Gestell.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    live = commands.add_parser("live", help="change a machine on a page in the browser",
                               description="Shows a machine on a page in the browser, where its input can be changed. The page is "
                               "for this computer only. The file itself is not changed.")
    live.add_argument("file", help="input file, such as machine.nml")
    live.add_argument("--port", type=int, default=PORT, help=f"port of the page on this computer (default {PORT})")
    live.add_argument("--no-browser", action="store_true", help="only print the address of the page")
    options = parser.parse_args(arguments)
    if hasattr(sys.stdout, "reconfigure"):
        # a terminal that cannot show a name shows ? in its place
        sys.stdout.reconfigure(errors="replace")
        sys.stderr.reconfigure(errors="replace")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with Server(options.file, options.port) as server:
            print(f"{options.file} is shown at {server.address}\nStop with Ctrl+C.", flush=True)
            if not options.no_browser:
                webbrowser.open(server.address)
            server.serve_forever()
    except Error as error:
        print(error.message, file=sys.stderr)
        return error.code
    except BrokenPipeError:
        return 1
    except (OSError, OverflowError) as error:
        print(f"port {options.port} cannot be used: {error}; choose another one with --port", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
