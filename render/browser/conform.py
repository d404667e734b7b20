"""The conformance page of `pogema conform` fits a phone."""

import os
import subprocess

from support import equal


def test_the_conformance_page_fits_a_phone(world):
    path = world.scratch / "conform.html"
    command = [os.environ["POGEMA_PROGRAM"], "conform", "--port", "python3 conformance/ports/template.py"]
    subprocess.run([*command, "--cases", "20", "--html", str(path)], check=True, capture_output=True)
    context = world.browser.new_context(viewport={"width": 390, "height": 844}, is_mobile=True)
    page = context.new_page()
    page.goto(path.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "the page is wider than the phone"
    wide = page.evaluate(
        "[...document.querySelectorAll('.wide')].filter((box) => box.scrollWidth > box.clientWidth).length"
    )
    equal(wide, 0, "the table of one port needs no scrolling")
    broken = page.evaluate("""[...document.querySelectorAll('th[scope=row]')].filter((cell) => {
      const text = document.createRange();
      const nodes = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
      for (let node = nodes.nextNode(); node; node = nodes.nextNode())
        for (const word of node.data.matchAll(/[^-]+-?/g)) {
          text.setStart(node, word.index);
          text.setEnd(node, word.index + word[0].length);
          if (text.getClientRects().length > 1) return true;
        }
      return false;
    }).map((cell) => cell.textContent)""")
    equal(broken, [], "no name of a rule breaks inside a word")
    sizes = page.evaluate(
        "[...document.querySelectorAll('th, td, caption')].map((cell) => parseFloat(getComputedStyle(cell).fontSize))"
    )
    assert min(sizes) >= 12, min(sizes)
    context.close()
