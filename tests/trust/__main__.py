"""`make trust`: security and reliability, as a table each, or as one.

    python -m tests.trust [security | reliability]

Every failure is a line on standard error, and makes the exit code 1.
"""

from __future__ import annotations

import argparse
import sys

from tests.trust import reliability, security, tables

PARTS = {"security": security.run, "reliability": reliability.run}


def main() -> int:
    """Print the table; 1 when anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="?", choices=PARTS)
    part = parser.parse_args().part
    counted = [PARTS[each]() for each in ([part] if part else PARTS)]
    tables.show(("what", "count"), [(what, str(count)) for part in counted for what, count in part.rows])
    failures = [line for part in counted for line in part.failures]
    print(*failures, sep="\n", end="\n" * bool(failures), file=sys.stderr)
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main())
