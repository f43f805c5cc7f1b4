#!/usr/bin/env python3
"""Writes the conformance cases as JSON for rtc-run --suite.   generate.py FOLDER"""
import importlib
import os
import sys

here = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, here)
sys.dont_write_bytecode = True
import suite

for file in sorted(os.listdir(os.path.join(here, "cases"))):
    if file.endswith(".py") and not file.startswith("_"):
        importlib.import_module("cases." + file[:-3])
cells = suite.write(sys.argv[1])
print(f"{len(suite.CASES)} cases with {cells} cells in {sys.argv[1]}")
