"""docs/porting-from-VK_NV_ray_tracing.md names everything of VK_NV_ray_tracing that vulkan_core.h has, and every
function of the KHR extensions; what it says stands on our side exists; its links lead somewhere, and the tests it
names are there.

usage: porting_listed.py ROOT VULKAN_CORE_H
"""
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

rows = [line for line in text.splitlines() if line.startswith("| `") or line.startswith("| in shaders")]
named = {n for row in rows for n in re.findall(r"`(\w+)`", row.split("|")[1])}
bad = [f"{n}: no row" for n in sorted(needed - named)] + [f"{n}: no row" for n in sorted(khr - named)]
bad += [f"a row says unsupported: {row}" for row in rows if re.search(r"unsupported|not supported", row, re.I)]
nv_rows = [row for title in ("## Functions", "## What the extension adds", "## Structures", "## Enums and flags")
           for row in chapter(title).splitlines() if row.startswith("| `")]
bad += [f"no test: {row}" for row in nv_rows if "](" not in row.split("|")[3]]
ours = "".join((root / f"include/rtc/{h}.h").read_text() for h in ("runtime", "compiler", "runtime_compiler"))
bad += [f"{n}: not in our headers" for n in sorted(set(re.findall(r"`((?:rtr|Rtr|RTR_|rtcc_)\w+)(?!\w|…)", text)))
        if not re.search(rf"\b{n}\b", ours)]
for label, link in re.findall(r"\[([^\]]+)\]\(([^)#]+)\)", text):
    target = (page.parent / link).resolve()
    if not target.exists():
        bad.append(f"{link}: no such file")
    elif re.fullmatch(r"\w+\.\w+", label) and label.count(".") == 1 and not label.endswith(".md"):
        fixture, case = label.split(".")
        if not re.search(rf"\({fixture}, (?:DISABLED_)?{case}\)", target.read_text()):
            bad.append(f"{label}: no such test in {link}")
print(f"{len(needed)} names of VK_NV_ray_tracing, {len(khr)} functions of KHR")
print("\n".join(bad))
sys.exit(1 if bad or len(needed) < 80 or len(khr) < 20 else 0)
