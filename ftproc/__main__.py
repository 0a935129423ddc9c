"""`python -m ftproc` is `ftproc`.

Python looks for modules in the current directory first, where a log may lie beside files of any name, and workers get
the path of this process. It is taken away before anything else is imported; `python -P -m ftproc` never has it.
"""

import os
import sys

if __name__ == "__main__":
    if not sys.flags.safe_path and sys.path[0] != os.path.dirname(os.path.dirname(__file__)):  # noqa: PTH120
        del sys.path[0]
    from ftproc.cli.main import main

    main()
