"""Settings of Sphinx for the documentation: `python -m sphinx -W docs build/docs`, with the extra `docs`."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "library")]

project = "Atwood"
copyright = "The Atwood authors"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "myst_nb"]
html_theme = "furo"
html_title = "Atwood"
exclude_patterns = ["build", "jupyter_execute"]
nb_execution_mode = "force"  # of pages that are notebooks: those of the course
nb_execution_raise_on_error = True
nb_execution_timeout = 120
myst_heading_anchors = 3
suppress_warnings = [
    "myst.xref_missing",  # pages link to files of the repository, which stand outside of the pages
    "ref.python",  # several classes have an attribute of the same name
]
napoleon_numpy_docstring = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = [("Connectors", "params_style"), ("Quantities", "params_style")]  # of components
napoleon_preprocess_types = False
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "groupwise"
autodoc_default_options = {"members": True, "show-inheritance": True}
default_role = "code"  # names in single backticks are code
