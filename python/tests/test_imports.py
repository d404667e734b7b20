"""No two modules of the package import each other, however far apart."""

import ast

from test_docstrings import ROOT

PATHS = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(ROOT.rglob("*.py"))
}

#: The environment that is built in is imported when an evaluation first asks for it, as in pogema-toolbox.
ACCEPTED = {("pogema_rs.toolbox.registry", "pogema_rs.toolbox.create_env")}


def imported(path):
    """The modules of the package that a file imports, for types alone or inside of functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            # What a package offers of its own is in the package; the rest are its modules.
            yield from (name for name in names if name in PATHS)
            if node.module != "pogema_rs" and not all(name in PATHS for name in names):
                yield node.module


def test_no_two_modules_import_each_other():
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
