"""Reads ctest's JUnit file; prints each skipped test's reason, then `N passed, N failed, N skipped`."""
import re
import sys
import xml.etree.ElementTree as xml

# ctest repeats the failure text in these; a skipped GoogleTest prints "file:line: Skipped" and its reason.
REASON = re.compile(r"(?:: Skipped\s*\n|\[skip\][ ]*|SKIP(?:PED)?:[ ]*)([^\n]+)")


def main() -> int:
    passed, failed, reasons = 0, [], {}
    for case in xml.parse(sys.argv[1]).getroot().iter("testcase"):
        name, status = case.get("name"), case.get("status")
        if status == "run":
            passed += 1
        elif status == "notrun" and case.find("skipped") is not None:
            output = "".join(case.find("system-out").itertext()) if case.find("system-out") is not None else ""
            found = REASON.search(output)
            reasons.setdefault(found.group(1).strip() if found else "NO REASON GIVEN", []).append(name)
        elif status == "disabled":
            pass  # long tests, run by hand: not part of this tier
        else:
            failed.append(name)
    for reason, names in sorted(reasons.items()):
        more = f" and {len(names) - 3} more" if len(names) > 3 else ""
        print(f"skipped: {', '.join(names[:3])}{more}: {reason}")
    for name in failed:
        print(f"failed: {name}")
    print(f"test: {sys.argv[2]} s in all")
    print(f"{passed} passed, {len(failed)} failed, {sum(map(len, reasons.values()))} skipped")
    return 1 if failed or passed == 0 else 0


sys.exit(main())
