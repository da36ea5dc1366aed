"""Sphinx's settings (scripts/docs.sh): pages in Markdown, the C reference from the headers by Doxygen and Breathe, the
Python reference from the docstrings of the package that is installed."""
import importlib.util
import os

project = "subadmm"
html_title = "subadmm"
html_theme = "furo" if importlib.util.find_spec("furo") else "alabaster"
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc"]
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
breathe_projects = {"subadmm": os.environ["SUBADMM_DOXYGEN_XML"]}
breathe_default_project = "subadmm"
breathe_domain_by_extension = {"h": "c"}
c_id_attributes = ["SADMM_API"]
autodoc_typehints = "description"
nitpicky = False
# Pages name files of the repository, which stand beside them there and not here; tests/test_docs.py looks that they
# exist. `typedef struct x {} x;` is two declarations of one name.
suppress_warnings = ["myst.xref_missing", "duplicate_declaration.c"]
