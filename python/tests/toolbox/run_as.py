"""Runs a script on pogema-toolbox or pogema_rs: run_as.py PACKAGE FOLDERS SCRIPT [ARGUMENT...]

PACKAGE is `pogema`, `pogema_rs` (pogema-toolbox on our POGEMA), `pogema_rs.toolbox` (both ours), or `changed` for a
script that imports `pogema_rs` itself. FOLDERS, separated as in PATH, hold pogema-toolbox and what it imports.
"""

import importlib
import os
import runpy
import sys
import warnings

if __name__ == "__main__":
    _, package, folders, *sys.argv = sys.argv
    sys.path += folders.split(os.pathsep)
    warnings.simplefilter("ignore")
    if package not in ("pogema", "changed"):
        importlib.import_module("pogema_rs").install_as_pogema(toolbox=package == "pogema_rs.toolbox")
    runpy.run_path(sys.argv[0], run_name="__main__")
