"""Formulas as MathML, which browsers draw themselves: nothing has to be fetched to read them."""

import re
from html import escape
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

_LOG = logging.getLogger(__name__)


def _mathml(node: nodes.math | nodes.math_block) -> str:
    # docutils knows \textstyle at the head of a group alone; a code host knows it everywhere
    tex = node.astext().replace(r"\textstyle", "")
    try:
        formula = tex2mathml(tex, as_block=isinstance(node, nodes.math_block))
    except MathError as error:
        _LOG.warning("formula %r: %s", tex, error, location=node, type="mathml")
        return f"<code>{escape(tex)}</code>"
    # plain braces are as high as what they hold, like plain brackets
    return re.sub(r"<mo>([{}])</mo>", r'<mo stretchy="false">\1</mo>', formula)


def _inline(translator: HTML5Translator, node: nodes.math) -> None:
    translator.body.append(_mathml(node))
    raise nodes.SkipNode


def _block(translator: HTML5Translator, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="math" style="overflow-x: auto">{_mathml(node)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
