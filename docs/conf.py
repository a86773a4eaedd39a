"""The documentation's build (make docs)."""

project = "HSV bench"
copyright = "HSV bench maintainers"
html_title = "HSV bench"
extensions = ["myst_parser"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_copy_source = False
html_show_sourcelink = False
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # a page that includes a whole file of the repository
pygments_style = "friendly"

# Files of the repository that are pages here under another name: links to them lead to the page.
PAGES = {"../offline_design/results.md": "results.md", "../offline_design/README.md": "design.md"}


def setup(app):
    """Let links that hold in the repository hold in the built pages."""

    def read(app, docname, source):
        for file, page in PAGES.items():
            source[0] = source[0].replace(f"]({file})", f"]({page})")

    app.connect("source-read", read)
