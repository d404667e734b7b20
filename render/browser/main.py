"""Runs the browser tests: main.py FOLDER [TEST...]."""

import os
import sys
import tempfile
import time
import traceback

from playwright.sync_api import sync_playwright

import conform
import editor
import editor_files
import pictures
import replay
import replay_episode
import report
import speed
from support import FLAGS, World


def tests_of(module):
    return [(name, test) for name, test in vars(module).items() if name.startswith("test_")]


def main(folder, *names):
    failed = 0
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as scratch:
        browser = playwright.chromium.launch(executable_path=os.environ["BROWSER"], args=FLAGS)
        world = World(browser, folder, os.environ["PAGES_PROGRAM"], scratch)
        chosen = [
            (name, test)
            for module in (
                (speed,)
                if names == ("speed",)
                else (replay_episode, replay, editor, editor_files, pictures, report, conform)
            )
            for name, test in tests_of(module)
            if not names or any(part in f"{module.__name__}.{name}" for part in names)
        ]
        for name, test in chosen:
            began = time.monotonic()
            try:
                note = test(world)
                print(f"ok     {name} ({time.monotonic() - began:.1f} s){': ' + note if note else ''}", flush=True)
            except Exception:  # noqa: BLE001, every exception is a failed test
                failed += 1
                print(f"FAILED {name}\n{traceback.format_exc(limit=-3)}", flush=True)
        browser.close()
    print(f"{len(chosen) - failed} of {len(chosen)} browser tests passed")
    if failed or not chosen:
        sys.exit(1)


main(*sys.argv[1:])
