"""A pipeline as glslang of December 2019 compiled it: SPIR-V 1.0, version 8 of that generator (glslang-2019/)."""
from suite import *


def old(name):
    return {"assembly": f"glslang-2019/case{name}.spvasm", "version": "spv1.0"}


FIRST, SECOND = 100 + 20 + 3 + 1 + 4, 200 + 20 + 5 + 1 + 4  # payload * 100 + weight + record + primitive + t
SUM = 7 + 2 * (FIRST + SECOND)
case("payloads/glslang-2019", {
    "rgen": old(".rgen"), "rchit": old(".rchit"), "rchit:shade": old("-shade.rchit"), "rahit": old(".rahit"), "rmiss": old(".rmiss"),
    "rmiss:far": old("-far.rmiss"), "rcall": old(".rcall")},
     [expect("2019: payloads, attributes, an ignore in a function and records", 0, [SUM]),
      expect("2019: a callable", 1, [SUM * 3]), expect("2019: a payload of another location", 2, [28, 2]),
      expect("2019: a second lane", 4, [SUM, SUM * 10 + 2, 8, 2])],
     section="issue 3 SPIR-V from other front ends", size=(2, 1, 1), only=["rtc-nv"],
     scene={"meshes": [{"name": "t", "triangles": [triangle(0.5), triangle(1.0)], "geometry-flags": ["no-duplicate-any-hit"]}]},
     groups=[{"name": "h", "closest": "rchit", "any": "rahit"}, {"name": "s", "closest": "shade"}],
     table={"raygen": [{"group": "rgen", "data": {"u32": [7, 0, 0, 0, 2]}}], "miss": ["rmiss", "far"],
            "hit": [{"group": "h", "data": {"u32": 3}}, {"group": "h", "data": {"u32": 5}}, "s"],
            "callable": [{"group": "rcall", "data": {"u32": f}} for f in (3, 10)]})
