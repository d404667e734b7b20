"""Tests that the imports between modules of the package have no cycle."""

import ast

from test_docstrings import ROOT

PATHS = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(ROOT.rglob("*.py"))
}

#: The registry imports the built-in environment on first use, as in pogema-toolbox.
ACCEPTED = {("pogema_rs.toolbox.registry", "pogema_rs.toolbox.create_env")}


def imported(path):
    """Yields the modules of the package that a file imports, including imports for types and inside functions."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            # A name is a module of the package, or an attribute of the package itself.
            yield from (name for name in names if name in PATHS)
            if node.module != "pogema_rs" and not all(name in PATHS for name in names):
                yield node.module


def test_imports_have_no_cycle():
    edges = {
        name: {other for other in imported(path) if other in PATHS and (name, other) not in ACCEPTED}
        for name, path in PATHS.items()
        if name != "pogema_rs"
    }
    assert sum(map(len, edges.values())) > 40
    finished = set()

    def visit(name, above):
        assert name not in above, " -> ".join([*above[above.index(name) :], name])
        if name not in finished:
            for other in sorted(edges.get(name, ())):
                visit(other, [*above, name])
            finished.add(name)

    for name in sorted(edges):
        visit(name, [])
