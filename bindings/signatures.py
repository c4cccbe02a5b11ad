"""Every function for C is the same in include/gestell.h, in Fortran (src/api/c) and in Python's list: python3 bindings/signatures.py

Number and types of the arguments and the type of the result are compared, those of the callback too. The last line is
"N passed, M failed".
"""
import ast
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
POINTERS = {"char *", "int *", "double *", "void *", "handle", "handle *"}
# What may stand in the header for a declaration of Fortran, and for a type of Python's.
FORTRAN = {"integer(c_int),value": {"int"}, "real(c_double),value": {"double"}, "type(c_ptr),value": POINTERS,
           "type(c_funptr),value": {"function"}, "integer(c_int),intent(out),optional": {"int *"},
           "type(c_ptr),intent(out),optional": {"handle *"}, "type(c_ptr),intent(inout),optional": {"handle *"},
           "integer(c_int)": {"int"}, "type(c_ptr)": {"handle"}, "": {"void"}}
PYTHON = {"c_int": {"int"}, "c_double": {"double"}, "c_char_p": {"char *"}, "c_void_p": POINTERS, "POINTER(c_int)": {"int *"},
          "POINTER(c_void_p)": {"handle *"}}
# What Python calls elsewhere than in its list, or has no use for.
NOT_IN_PYTHON = {"gestell_solve_many", "gestell_solve_system"}


def c_type(declaration):
    """The type of `const char *name`, `double name[4]`, `gestell_error *error`; handles are one type."""
    words = re.sub(r"\b(const|struct)\b|\[\d*\]", lambda found: "*" if found[0].startswith("[") else "", declaration)
    kind = re.match(r"\s*(\w+)", words)[1]
    kind = {"gestell_coefficients": "function"}.get(kind, "handle" if kind.startswith("gestell_") else kind)
    return kind + (" " + "*" * words.count("*") if "*" in words else "")


def header():
    """{name: [types of result and arguments]}"""
    text = re.sub(r"/\*.*?\*/", "", (ROOT / "include/gestell.h").read_text(), flags=re.S)
    found = re.findall(r"^(?:typedef )?(\w+) \(?\*?(gestell_\w+)\)?\(([^)]*)\);", text, flags=re.M)
    return {name: [c_type(result)] + [c_type(each) for each in arguments.split(",") if each.strip() != "void"]
            for result, name, arguments in found}


def fortran():
    """{name: [declarations of result and arguments]}"""
    text = "\n".join(file.read_text() for file in sorted((ROOT / "src/api/c").glob("*.f90")))
    text = re.sub(r" *&\n *&", "", text)
    functions = {}
    for head, arguments, tail, body in re.findall(
            r"^ *((?:\w+\(c_\w+\) )?(?:function|subroutine) +\w+)\(([^)]*)\)([^\n]*bind\(c[^\n]*)\n(.*?)^ *end (?:function|subroutine)", text,
            flags=re.M | re.S):
        name = (re.search(r'name="(\w+)"', tail) or [None, "gestell_" + head.split()[-1]])[1]
        declared = {}
        for kind, names in re.findall(r"^ *([^!\n]+?) :: (.*)$", body, flags=re.M):
            declared.update((each.strip(), kind.replace(" ", "")) for each in names.split(","))
        result = head.split()[0] if len(head.split()) == 3 else ""
        if name.startswith("gestell_"):
            functions[name] = [result] + [declared[each.strip()] for each in arguments.split(",") if each.strip()]
    return functions


def python():
    """{name: [types of result and arguments]}"""
    tree = ast.parse((ROOT / "python/gestell/_library.py").read_text())
    table = next(node.value for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == "_SIGNATURES")
    return {"gestell_" + key.value: ["c_int"] + [ast.unparse(each) for each in value.elts]
            for key, value in zip(table.keys, table.values)}


def main():
    wanted = header()
    listed = {name for name, types in wanted.items() if types[0] == "int"} - NOT_IN_PYTHON
    passed = failed = 0
    for language, there, kinds, names in (("Fortran", fortran(), FORTRAN, set(wanted)), ("Python", python(), PYTHON, listed)):
        for name in sorted(names | set(there)):
            of_header, own = wanted.get(name), there.get(name)
            if of_header and own and len(own) == len(of_header) and all(c in kinds.get(kind, ()) for c, kind in zip(of_header, own)):
                passed += 1
            else:
                failed += 1
                print(f"FAIL  {name}: {of_header} in gestell.h, {own} in {language}")
    print(f"{passed} passed, {failed} failed")
    return failed != 0 or passed == 0


if __name__ == "__main__":
    sys.exit(main())
