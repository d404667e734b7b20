"""Checks the pages of the site: python3.11 docs/links.py SITE

Every link and picture must lead to a file of the site, and every fragment to an element of its page. Links to other
hosts are not followed. Each page of the book must say what to read next.
"""

import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Folders of pages that other programs generate; those programs check their own links.
GENERATED = ("rust", "python")
# Pages without a next page: print.html repeats the other pages.
SKIPPED = ("print.html", "404.html", "toc.html")


class Page(HTMLParser):
    """The links and the named elements of one page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.names: set[str] = set()
        self.text = path.read_text(encoding="utf-8", errors="replace")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if value and (key == "id" or (tag == "a" and key == "name")):
                self.names.add(value)
            elif value and key in ("href", "src"):
                self.links.append(value)


@cache
def read(path: Path) -> Page:
    """Returns the page in a file."""
    return Page(path)


def fault(site: Path, page: Path, link: str) -> str | None:
    """Returns what is wrong with a link, or None."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return None
    if parts.path.startswith("/"):
        return "is absolute, expected a relative link, because the site may lie below any path"
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    if target.is_dir():
        target /= "index.html"
    if not target.is_relative_to(site) or not target.is_file():
        return "leads to no file of the site, expected the path of an existing file"
    if parts.fragment and target.suffix == ".html" and target.relative_to(site).parts[0] not in GENERATED:
        if unquote(parts.fragment) not in read(target).names:
            return f"leads to no element of {target.relative_to(site)}"
    return None


def main() -> None:
    """Prints every fault; the exit status is 1 if there is one."""
    site = Path(sys.argv[1]).resolve()
    pages = [path for path in sorted(site.rglob("*.html")) if path.relative_to(site).parts[0] not in GENERATED]
    faults, num_links = [], 0
    if not pages:
        faults.append(f"{site}: found no page, expected the folder of a built site")
    for page in pages:
        name = page.relative_to(site)
        for link in dict.fromkeys(read(page).links):
            num_links += 1
            found = fault(site, page, link)
            if found:
                faults.append(f"{name}: the link `{link}` {found}")
        is_of_book = 'class="menu-title"' in read(page).text
        if is_of_book and str(name) not in SKIPPED and "What next:" not in read(page).text:
            faults.append(f"{name}: the page has no next step, expected the text `What next:`")
    print("\n".join(faults) or f"{num_links} links on {len(pages)} pages are valid")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
