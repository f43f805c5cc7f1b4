"""Every relative link of the project's pages leads to a file that is there.

usage: links_resolve.py ROOT
"""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])
pages = [*root.glob("*.md"), *root.glob("docs/*.md"), *root.glob("t*/**/*.md")]
bad, count = [], 0
for page in sorted(pages):
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", link) or link.startswith("#"):
            continue
        count += 1
        if not (page.parent / link.split("#")[0]).exists():
            bad.append(f"{page.relative_to(root)}: {link}")
print(f"{count} links in {len(pages)} pages")
print("\n".join(bad))
sys.exit(1 if bad or count < 20 else 0)
