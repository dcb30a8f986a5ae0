"""The manual: `sphinx-build -W --keep-going docs docs/build`, with the packages of the extra `docs`."""

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from generate import against, api, commands, errors, gallery, keys, sources_beside  # noqa: E402

from toolpoint import __version__  # noqa: E402

project, author, copyright = "toolpoint", "The toolpoint developers", "The toolpoint developers, BSD 3-Clause licence"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.mathjax", "numpydoc",
              "sphinx_gallery.gen_gallery"]
exclude_patterns = ["build", "generated/source_*.md", "generated/examples_source", "generated/gallery/**/*.ipynb",
                    "generated/gallery/**/*.py",
                    "generated/gallery/**/*.json", "generated/gallery/**/*.md5"]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
html_theme = "pydata_sphinx_theme"
html_title = "toolpoint"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": True,
                      "secondary_sidebar_items": {  # the tables of the sources need the width
                          "**": ["page-toc"], **{f"sources/{name}": [] for name in sources_beside.NAMES}}}
html_show_sourcelink = False
autodoc_typehints = "none"
autosummary_generate = True
numpydoc_show_class_members = False
mathjax_path = "https://cdn.jsdelivr.net/npm/mathjax@3/es5/tex-mml-chtml.js"
# Links out of docs/ into the repository and words of code in foreign languages are no faults of the manual.
suppress_warnings = ["myst.xref_missing", "config.cache", "misc.highlighting_failure"]

GENERATED = HERE / "generated"
GENERATED.mkdir(exist_ok=True)
for write in (keys.write_keys, errors.write_errors, commands.write_commands, against.write_against, api.write_api,
              sources_beside.write_sources):
    write(GENERATED)
gallery.write_examples(GENERATED / "examples_source")
gallery.record_pages()
sphinx_gallery_conf = {
    "examples_dirs": "generated/examples_source", "gallery_dirs": "generated/gallery",
    "filename_pattern": r"\.py", "image_scrapers": (gallery.PageScraper(),),
    "plot_gallery": os.environ.get("GALLERY", "1") == "1",
    "subsection_order": [f"generated/examples_source/{group}" for group in gallery.GROUPS],
    "within_subsection_order": "FileNameSortKey", "download_all_examples": False, "show_memory": False,
    "capture_repr": (), "remove_config_comments": True, "min_reported_time": 5,
    "default_thumb_file": str(HERE / "demo.png"), "reset_modules": (),  # which would need matplotlib
}
