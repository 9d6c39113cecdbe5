"""Settings of Sphinx for the documentation: `python -m sphinx -W docs build/docs`, with the extra `docs`."""

import sys
from importlib.resources import files
from pathlib import Path

from sphinx.util.fileutil import copy_asset

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "library"), str(ROOT / "docs")]

project = "Atwood"
copyright = "The Atwood authors"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "myst_nb"]
html_theme = "furo"
html_title = "Atwood"
exclude_patterns = ["build", "jupyter_execute", "gallery-files"]
html_extra_path = ["gallery-files"]  # pages that move, each a file of its own
(ROOT / "docs" / "gallery-files").mkdir(exist_ok=True)  # the gallery is written later, and Sphinx asks for it before
html_static_path = ["static"]
html_css_files = ["site.css"]
nb_execution_mode = "force"  # of pages that are notebooks: those of the course, and tutorials
nb_execution_raise_on_error = True
nb_execution_timeout = 120
myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
myst_mathjax_classes = "tex2jax_process|mathjax_process|math|output_area|text_html"  # also what cells show as HTML
mathjax3_config = {"tex": {"inlineMath": [["\\(", "\\)"], ["$", "$"]]}}
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


mathjax_path = "mathjax/tex-chtml.js"  # within the site, which asks for nothing outside


def copy_mathjax(app, error):
    """Copy what formulas need: one script and its letters."""
    source = files("sphinx-mathjax-offline").joinpath("static", "mathjax")
    target = Path(app.outdir) / "_static" / "mathjax"
    if error is None:
        for name in ("tex-chtml.js", "output/chtml/fonts"):
            copy_asset(source / name, (target / name).parent if name.endswith(".js") else target / name)


def setup(app):
    """Write what is made by programs before pages are read, and copy what formulas need."""
    from gallery import write_gallery
    from parts_pages import write_parts
    from validation_pages import write_validation

    app.connect("builder-inited", write_gallery)
    app.connect("builder-inited", write_parts)
    app.connect("builder-inited", write_validation)
    app.connect("build-finished", copy_mathjax)
