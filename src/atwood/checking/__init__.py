"""The conformance test of components: what parts of the library pass, and what `atwood check` asks of others."""

from atwood.checking.conformance import check
from atwood.checking.samples import CheckReport, Finding

__all__ = ["CheckReport", "Finding", "check"]
