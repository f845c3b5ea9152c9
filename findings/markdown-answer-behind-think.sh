#!/usr/bin/env bash
# markdown-it-py 4.0.0, mistune 3.1.4, commonmark 0.9.1: the first paragraph of an answer is no Markdown when it follows
# a line "</think>" without a blank line. A tag alone on its line begins an HTML block that ends at a blank line
# (CommonMark 0.31 section 4.6, kind 7), so "<think>\n...\n</think>\nHello, **friend**." is one raw block: whoever leaves
# HTML out to hide the reasoning loses the paragraph, whoever strips the tags alone shows the stars. With the tags in one
# line with words the same paragraph is Markdown.
# Fails (exit code 1) if a package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet markdown-it-py==4.0.0 mistune==3.1.4 commonmark==0.9.1

cat > "$work/run.py" <<'PYTHON'
import commonmark
import markdown_it
import mistune

alone = "<think>\nThe user greets.\n</think>\nHello, **friend**.\n\nIt *works*."
inline = "<think>The user greets.</think>\nHello, **friend**."
readers = {
    "markdown-it-py": markdown_it.MarkdownIt().render,
    "mistune": mistune.html,
    "commonmark": commonmark.commonmark,
}
for name, render in readers.items():
    html = render(alone)
    print(name, html.split("\n"))
    is_raw = "Hello, **friend**." in html and "<p>It <em>works</em>.</p>" in html
    if not is_raw or "<strong>friend</strong>" not in render(inline):
        raise SystemExit("changed")
kinds = [token.type for token in markdown_it.MarkdownIt().parse(alone)]
print("markdown-it-py", kinds)
if kinds[:2] != ["html_block", "paragraph_open"]:
    raise SystemExit("changed")
PYTHON
"$work/environment/bin/python" "$work/run.py"
echo "as described"
