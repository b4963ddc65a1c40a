"""Make sure that there is a Chromium for the browser tests: the system's, Playwright's, or a newly installed one."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def system_browser() -> str | None:
    """The path of a browser that the system has."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def own_browser() -> str | None:
    """The path of the browser that Playwright downloaded, if it did."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = playwright.chromium.executable_path
    return path if os.path.isfile(path) else None


def _tried(*command: str) -> bool:
    print("+", *command, flush=True)
    try:
        return subprocess.run(command, check=False).returncode == 0
    except FileNotFoundError:
        return False


def main() -> int:
    """Look, then install in the ways that there are; 1 where none of them worked."""
    if found := system_browser() or own_browser():
        print(f"browser: {found}")
        return 0
    _tried(sys.executable, "-m", "playwright", "install", "chromium")
    if not own_browser() and shutil.which("apt-get"):
        sudo = [] if os.geteuid() == 0 else ["sudo", "-n"]
        _tried(*sudo, "apt-get", "update", "-qq")
        _tried(*sudo, "apt-get", "install", "-y", "-qq", "chromium")
    if found := system_browser() or own_browser():
        print(f"browser: {found}")
        return 0
    print("No Chromium was found, and none could be installed: install one by hand.", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
