"""`make audit`: asks PyPI, by pip-audit, whether a vulnerability of one of the tested versions is known.

A missing answer fails nothing, but is reported.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

LIST = Path(__file__).parents[1] / "requirements-tested.txt"


def verdict(answer: str, complaint: str = "") -> tuple[list[str], int]:
    """What pip-audit printed as JSON, and on standard error -> lines for the user, and the exit code."""
    try:
        packages = json.loads(answer)["dependencies"]
    except (ValueError, KeyError, TypeError):
        reason = complaint.strip().splitlines()[-1] if complaint.strip() else "no output"
        return [f"NOT audited: pip-audit had no answer ({reason})."], 0
    unknown = [package["name"] for package in packages if "skip_reason" in package]
    holes = [
        f"{package['name']} {package['version']}: {hole['id']}, mended in {' or '.join(hole['fix_versions']) or 'none'}"
        for package in packages
        for hole in package.get("vulns", ())
    ]
    known = len(packages) - len(unknown)
    lines = [*holes, f"{known} of {len(packages)} packages audited, {len(holes)} vulnerabilities known."]
    if unknown:
        which = ", ".join(unknown) if known else "all of them"
        lines.append(f"NOT audited, for PyPI's JSON service gave no answer: {which}.")
    return lines, int(bool(holes))


def main() -> int:
    if importlib.util.find_spec("pip_audit") is None:
        print("pip-audit is not installed; `make audit` does it.", file=sys.stderr)
        return 1
    ask = ["-m", "pip_audit", "--format", "json", "--progress-spinner", "off", "--no-deps", "--disable-pip"]
    done = subprocess.run([sys.executable, *ask, "-r", str(LIST)], check=False, capture_output=True, text=True)
    lines, code = verdict(done.stdout, done.stderr)
    print("\n".join(lines))
    return code


if __name__ == "__main__":
    sys.exit(main())
