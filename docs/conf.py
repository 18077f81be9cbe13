"""The site's settings for Sphinx; `make docs` builds it. The pages are Markdown that GitHub shows as well."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent / "_extension"), str(Path(__file__).parents[1] / "src")]

from gallery_argv import picture_file  # noqa: E402 - after the path

from levelhead.version import VERSION  # noqa: E402

project = "levelhead"
author = "The levelhead developers"
project_copyright = "the levelhead developers, MIT licence"
version = release = VERSION

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_design",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "public_api",
    "pages",
]
exclude_patterns = [
    "_build",
    "_extension",
    "gallery/*.py",
    "gallery/*.ipynb",
    "gallery/*.json",
    "sg_execution_times.rst",
]
smartquotes = False  # --option is an option
nitpicky = True
suppress_warnings = ["config.cache"]  # the gallery's settings hold a function

myst_enable_extensions = ["colon_fence", "deflist", "attrs_inline"]
myst_heading_anchors = 4  # the anchors that GitHub gives

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
python_maximum_signature_line_length = 88
add_module_names = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "download_all_examples": False,
    "reset_argv": picture_file,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "remove_config_comments": True,
    "abort_on_example_error": True,
    "copyfile_regex": r".*\.rst",
}

html_theme = "pydata_sphinx_theme"
html_title = "levelhead"
html_favicon = "_static/logo.svg"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "logo": {"text": "levelhead", "image_light": "_static/logo.svg", "image_dark": "_static/logo.svg"},
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_toc_level": 2,
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
    "back_to_top_button": True,
}
html_sidebars = {"index": []}
html_context = {"default_mode": "auto"}
