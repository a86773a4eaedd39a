"""The documentation's build (make docs)."""

import re
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))

import site_pages  # noqa: E402
from docutils import nodes  # noqa: E402
from docutils.utils.math.latex2mathml import tex2mathml  # noqa: E402
from hsv.pages.fly import fly_page  # noqa: E402
from pygments.lexers.special import TextLexer  # noqa: E402

project = "HSV bench"
copyright = "HSV bench maintainers"
html_title = "HSV bench"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
exclude_patterns = ["_build", "static", "templates"]
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
templates_path = ["templates"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
suppress_warnings = [
    "myst.header",  # a page that includes a whole file of the repository
    "config.cache",  # of a function in autosummary_context
    "ref.python",  # a type whose name two modules have, in a signature that does not say whose
]
smartquotes = False  # two hyphens begin an option
html_math_renderer = "mathml"
pygments_style = "friendly"

autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autosummary_generate = True
# Pages of modules that are gone would not build.
shutil.rmtree(Path(__file__).parent / "reference" / "generated", ignore_errors=True)
autosummary_context = {"modules_of": site_pages.modules_of}
napoleon_numpy_docstring = False
python_use_unqualified_type_names = True

# Pages whose text ends with what is generated.
GENERATED = {"reference/commands": site_pages.commands, "reference/messages": site_pages.messages}


def math(display):
    """Return the visitors of formulas, in a line or displayed: MathML, which needs no script from elsewhere."""

    def visit(translator, node):
        translator.body.append(tex2mathml(node.astext(), as_block=display))
        raise nodes.SkipNode

    return visit, None


def setup(app):
    """Let links that hold in the repository hold in the built pages, and generate the reference."""
    app.add_html_math_renderer("mathml", inline_renderers=math(False), block_renderers=math(True))
    files = site_pages.included()

    def read(app, docname, source):
        source[0] = site_pages.text_of(docname, source[0], files)
        if docname in GENERATED:
            source[0] += "\n" + GENERATED[docname]()

    def outdated(app, env, added, changed, removed):
        return {*GENERATED, *files.values()} & env.found_docs

    def plain(app, what, name, obj, options, lines):
        # Bars are absolute values here; reStructuredText takes them for substitutions. Not in ``literals``.
        for i, line in enumerate(lines):
            parts = re.split(r"(``.*?``)", line)
            lines[i] = "".join(p if p.startswith("``") else p.replace("|", r"\|") for p in parts)

    def fly(app, failed):
        # The page that flies in the browser takes the place of the one that describes it in the repository.
        if not failed and app.builder.format == "html":
            Path(app.outdir, "fly.html").write_text(fly_page(), encoding="utf-8")

    app.add_lexer("mermaid", TextLexer)  # drawn by the hosts of repositories
    app.connect("source-read", read)
    app.connect("env-get-outdated", outdated)
    app.connect("autodoc-process-docstring", plain)
    app.connect("build-finished", fly)
