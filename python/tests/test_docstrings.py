"""Tests that public names have docstrings, their first lines end with a period, and lists of modules are complete."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pogema_rs

# Parsed, not imported: a module is public even if its framework is not installed.
ROOT = Path(pogema_rs.__file__).resolve().parent
MODULES = {
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(ROOT.rglob("*.py"))
    if path.name == "__init__.py" or not path.name.startswith("_")
}


def is_repeated(node):
    """Returns whether a definition is an overload or a property setter: another definition has the docstring."""
    marks = [getattr(mark, "attr", getattr(mark, "id", None)) for mark in node.decorator_list]
    return "overload" in marks or "setter" in marks


def public_names(body):
    """Returns the public names that a module or class defines, including public aliases of private functions."""
    names = {}
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not is_repeated(node):
            names[node.name] = node
        elif isinstance(node, ast.Assign) and isinstance(node.value, ast.Name) and node.value.id in names:
            names.update({target.id: names[node.value.id] for target in node.targets if isinstance(target, ast.Name)})
    return {name: node for name, node in names.items() if not name.startswith("_")}


def documented(name, node):
    """Yields a module or class and all public names in it."""
    yield name, node
    if not isinstance(node, ast.FunctionDef):
        for inner, child in public_names(node.body).items():
            yield from documented(f"{name}.{inner}", child)


def test_modules_are_found():
    assert {"pogema_rs", "pogema_rs.envs", "pogema_rs.vec_env", "pogema_rs.integrations.rllib"} <= MODULES.keys()


@pytest.mark.parametrize("module", MODULES)
def test_public_names_have_docstrings(module):
    tree = ast.parse(MODULES[module].read_text(encoding="utf-8"))
    wrong = [
        name
        for name, node in documented(module, tree)
        if not (ast.get_docstring(node) or "").partition("\n")[0].endswith(".")
    ]
    assert wrong == []


def test_aliases_of_private_functions_are_checked():
    tree = ast.parse("class A:\n    '''A.'''\n    def _b(self): ...\n    c = _b\n")
    assert [name for name, _ in documented("module", tree)] == ["module", "module.A", "module.A.c"]


@pytest.mark.parametrize("module", MODULES)
def test_package_docstring_lists_all_modules(module):
    # The start page of the reference links the modules from this docstring.
    assert module == "pogema_rs" or f"`{module}`" in pogema_rs.__doc__


def test_api_reference_leaves_out_the_modules_whose_frameworks_are_not_installed():
    # JAX is installed for the reference, but not here.
    names = [name for name in MODULES if not name.startswith("pogema_rs.jax")]
    program = f"""
import importlib
for name in {names!r}:
    try:
        importlib.import_module(name)
    except ImportError:
        print(name)
"""
    done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, check=True)
    script = (Path(__file__).resolve().parent.parent / "api").read_text(encoding="utf-8")
    left_out = re.search(r"^large=\((.*?)\)", script, re.MULTILINE | re.DOTALL)[1].split()
    assert done.stdout.split() == sorted(f"pogema_rs.{name}" for name in left_out)
