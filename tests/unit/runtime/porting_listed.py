"""docs/porting-from-VK_NV_ray_tracing.md names everything of VK_NV_ray_tracing that vulkan_core.h has, and every
function, type and value of the KHR extensions; what it says stands on our side exists; every row links to a test; the
links lead somewhere, the tests are there, and each mentions a name of the row, itself or through helpers it calls.

usage: porting_listed.py ROOT VULKAN_CORE_H
"""
import functools
import pathlib
import re
import sys

root, header = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).read_text()
page = root / "docs/porting-from-VK_NV_ray_tracing.md"
text = page.read_text()


def chapter(title):
    begin = text.index(title)
    end = text.find("\n## ", begin + 1)
    return text[begin:end if end > 0 else None]


def extension_section(name):
    """From its define to the next extension's."""
    begin = header.index(f"#define {name} 1\n")
    nexts = [m.start() for m in re.finditer(r"^#define VK_[A-Z]+_[a-z0-9_]+ 1$", header, re.M) if m.start() > begin]
    return header[begin:nexts[0]]


nv = extension_section("VK_NV_ray_tracing")
needed = set(re.findall(r"\b(?:vk|Vk|VK_)\w+NV\b|\bVK_NV_RAY_TRACING_\w+", nv))
# Values the extension adds to enums of others.
RAY = re.compile(r"RAY_TRACING_(?:BIT|SHADER|PIPELINE_CREATE_INFO|PROPERTIES|NV)|ACCELERATION_STRUCTURE|"
                 r"_SHADER_STAGE_(?:RAYGEN|ANY_HIT|CLOSEST_HIT|MISS|INTERSECTION|CALLABLE)|INDEX_TYPE_NONE|"
                 r"DEFER_COMPILE|TYPE_GEOMETRY")
needed |= {v for v in re.findall(r"\bVK_\w+_NV(?:_EXT)?\b", header) if RAY.search(v)}
# Of other extensions; and MAX_ENUM only gives enums their size.
OTHERS = re.compile(r"MOTION|MAX_ENUM|REORDER|^PFN_|MICROMAP|CLUSTER|PARTITIONED|SPHERES|LINEAR_SWEPT")
needed = {n for n in needed if not OTHERS.search(n)}
khr = set()
for name in ("VK_KHR_acceleration_structure", "VK_KHR_ray_tracing_pipeline"):
    khr |= set(re.findall(r"\b(vk\w+KHR)\(", extension_section(name)))
    khr |= set(re.findall(r"\b(Vk\w+KHR)\b", extension_section(name)))
# Values that are not an NV value under another name.
KHR_RAY = re.compile(r"ACCELERATION_STRUCTURE|RAY_TRACING_(?!MAINT)|SHADER_BINDING_TABLE|SHADER_GROUP_SHADER")
khr |= {v for v in re.findall(r"\bVK_\w+_KHR\b", header) if KHR_RAY.search(v) and not re.search(rf"_NV = {v}\b", header)
        and not re.search(r"MAX_ENUM|STRUCTURE_TYPE_|_OBJECT_TYPE_|CREATE_DESCRIPTOR", v)}
khr = {n for n in khr if not re.search(r"MICROMAP|MOTION|CLUSTER", n)}

rows = [line for line in text.splitlines() if line.startswith("| `") or line.startswith("| in shaders")]
named = {n for row in rows for n in re.findall(r"`(\w+)`", row.split("|")[1])}
bad = [f"{n}: no row" for n in sorted(needed - named)] + [f"{n}: no row" for n in sorted(khr - named) if f"`{n}`" not in chapter("## VK_KHR")]
bad += [f"a row says unsupported: {row}" for row in rows if re.search(r"unsupported|not supported", row, re.I)]
bad += [f"no test: {row}" for row in rows if "](" not in row.strip().strip("|").split(" | ")[-1]]
ours = "".join((root / f"include/rtc/{h}.h").read_text() for h in ("runtime", "compiler", "runtime_compiler"))
bad += [f"{n}: not in our headers" for n in sorted(set(re.findall(r"`((?:rtr|Rtr|RTR_|rtcc_)\w+)(?!\w|…)", text)))
        if not re.search(rf"\b{n}\b", ours)]
DEFINITION = re.compile(r"^[ \w:<>,*&~\[\]]*?\b(?:\w+::)?(\w+)\([^;{}]*\)(?: const)?(?: override)? \{", re.M)


def braces(source, at):
    depth = 0
    for brace in re.compile(r"[{}]").finditer(source, at):
        depth += 1 if brace.group() == "{" else -1
        if not depth:
            return source[at:brace.end()]
    return source[at:]


def helpers_of(file, seen):
    """Functions that a test file can call: its own, and those of the test headers it includes."""
    if file in seen or not file.is_file():
        return {}
    seen.add(file)
    source, found = file.read_text(), {}
    for match in DEFINITION.finditer(source):
        found.setdefault(match.group(1), []).append(match.group(0) + braces(source, match.end() - 1))
    for include in re.findall(r'#include "(\w+)\.h"', source):
        for place in {file.parent, root / "tests/unit/runtime"}:
            for ending in (".h", ".cpp"):
                for name, bodies in helpers_of(place / (include + ending), seen).items():
                    found.setdefault(name, []).extend(bodies)
    return found


@functools.cache
def told_by(file, label):
    """A test with all the helpers it reaches; of other links the whole file."""
    if not re.fullmatch(r"\w+\.\w+", label) or label.endswith(".md"):
        return file.read_text() if file.is_file() else None
    source = file.read_text()
    test = re.search(r"\(%s, (?:DISABLED_)?%s\) \{" % tuple(label.split(".")), source)
    if not test:
        return ""
    told, helpers = braces(source, test.end() - 1), helpers_of(file, set())
    while True:
        called = set(re.findall(r"\b(\w+)\(", told)) & helpers.keys()
        if not called:
            return told
        for name in called:
            told += "".join(helpers.pop(name))


for line in text.splitlines():
    names = set(re.findall(r"`(\w+)`", line)) if line in rows else set()
    for label, link in re.findall(r"\[([^\]]+)\]\(([^)#]+)\)", line):
        target = (page.parent / link).resolve()
        if not target.exists():
            bad.append(f"{link}: no such file")
            continue
        told = told_by(target, label)
        if told == "":
            bad.append(f"{label}: no such test in {link}")
        elif names and told is not None and not any(re.search(rf"\b{n}\b", told) for n in names):
            bad.append(f"{label} in {link} says nothing of {', '.join(sorted(names)[:3])}, ...")
print(f"{len(needed)} names of VK_NV_ray_tracing, {len(khr)} names of KHR")
print("\n".join(bad))
sys.exit(1 if bad or len(needed) < 80 or len(khr) < 20 else 0)
