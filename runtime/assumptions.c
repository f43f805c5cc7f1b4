/* What a module was told about scenes (rtc --assume, docs/specialisation.md): names, checks
 * of what the host can see, messages for what only the device saw, and scene profiles. */
#include <stdio.h>

#include "internal.h"

typedef struct Assumption {
    uint32_t bit;
    const char* name;
    const char* broken; /* what is wrong with the instance */
    const char* remedy;
} Assumption;

/* The names are the compiler's (link/facts.cpp). */
static const Assumption k_assumptions[] = {
    {RTC_FACT_ALL_OPAQUE, "opaque", "is not opaque",
     "set VK_GEOMETRY_OPAQUE_BIT_NV or the instance flag FORCE_OPAQUE"},
    {RTC_FACT_SINGLE_LEVEL, "single-level", "", "trace a top level with one active instance"},
    {RTC_FACT_IDENTITY_TRANSFORMS, "identity-transforms", "has a transform that is not the identity",
     "transform the vertices instead"},
    {RTC_FACT_FULL_MASKS, "no-masks", "has a mask other than 0xff", "set its mask to 0xff"},
    {RTC_FACT_NO_INSTANCE_FLAGS, "no-instance-flags", "has instance flags", "clear its flags"},
    {RTC_FACT_HAS_AABBS, "triangles", "is made of AABBs", "leave it out"},
    {RTC_FACT_HAS_TRIANGLES, "aabbs", "is made of triangles", "leave it out"},
};
#define ASSUMPTIONS (sizeof k_assumptions / sizeof k_assumptions[0])

static const Assumption* find(uint32_t bit) {
    size_t i;
    for (i = 0; i < ASSUMPTIONS; i++)
        if (k_assumptions[i].bit == bit) return &k_assumptions[i];
    return NULL;
}

void rtr_format_assumption(uint32_t bit, uint32_t offender, char* text, size_t size) {
    const Assumption* a = find(bit);
    const uint32_t geometry = offender & RTC_OFFENDER_GEOMETRY_MASK;
    char who[96];
    if (!a) {
        snprintf(text, size, "the scene breaks an assumption of the module (fact 0x%x)", bit);
        return;
    }
    if (bit == RTC_FACT_SINGLE_LEVEL)
        snprintf(who, sizeof who, "the top level has %u active instances", offender);
    else if (bit == RTC_FACT_ALL_OPAQUE && geometry != RTC_OFFENDER_NO_GEOMETRY)
        snprintf(who, sizeof who, "geometry %u of the bottom level of instance %u %s", geometry,
                 offender >> RTC_OFFENDER_INSTANCE_SHIFT, a->broken);
    else
        snprintf(who, sizeof who, "instance %u %s", offender >> RTC_OFFENDER_INSTANCE_SHIFT, a->broken);
    snprintf(text, size, "the module assumes '%s', but %s: not traced; %s, or compile without --assume=%s", a->name,
             who, a->remedy, a->name);
}

uint32_t rtr_first_not_opaque(const VkAccelerationStructureInfoNV* info) {
    uint32_t g;
    for (g = 0; g < info->geometryCount; g++)
        if (!(info->pGeometries[g].flags & VK_GEOMETRY_OPAQUE_BIT_NV))
            return g < RTC_OFFENDER_NO_GEOMETRY ? g : RTC_OFFENDER_NO_GEOMETRY - 1;
    return 0xffffffffu;
}

/* ---- What the host can see ------------------------------------------------------------- */

VkResult rtrCmdDeclareScene(RtrRecorder r, uint32_t count, const RtrAccelerationStructure* structures) {
    RtrDeclaredScene scene = RTR_NOTHING_DECLARED;
    uint32_t i, g;
    VkResult result;
    if (!r->cmd) return rtr_not_begun(r, "rtrCmdDeclareScene");
    for (i = count; i-- > 0;) {
        const struct RtrAccelerationStructure_T* as = structures[i];
        if (!as)
            return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "declare-scene", "structure %u is NULL; name those that launches reach",
                             i);
        if (as->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) continue;
        for (g = as->geometry_count; g-- > 0;) {
            if (as->aabbs)
                scene.aabbs = i;
            else
                scene.triangles = i;
            if (as->geometries[g].flags & VK_GEOMETRY_OPAQUE_BIT_NV) continue;
            scene.not_opaque = i;
            scene.not_opaque_geometry = g;
        }
    }
    for (i = 0; i < count; i++) {
        const struct RtrAccelerationStructure_T* as = structures[i];
        const uint32_t heap = as->heap ? as->heap->id : 0;
        if (!as->buffer) continue;
        if (!scene.bound) {
            scene.bound = true;
            scene.heap = heap;
            scene.at = i;
        } else if (heap != scene.heap && scene.elsewhere == ~0u) {
            scene.elsewhere = i;
        }
    }
    r->scene = scene;
    rtr_forget_declared(r);
    for (i = 0; r->device->validation && i < count; i++)
        if ((result = rtr_add_checked(r, structures[i], i)) != VK_SUCCESS) return result;
    return VK_SUCCESS;
}

VkResult rtr_check_scene(RtrRecorder r, const struct RtrPipeline_T* p) {
    const uint32_t assumed = p->header.assumptions;
    const RtrDeclaredScene* s = &r->scene;
    /* An instance flag could make a geometry opaque, unless there are none. */
    const bool flags = !(assumed & RTC_FACT_NO_INSTANCE_FLAGS);
    const Assumption* a = NULL;
    uint32_t at = ~0u;
    char geometry[40] = "";
    if ((assumed & RTC_FACT_HAS_AABBS) && s->aabbs != ~0u) {
        a = find(RTC_FACT_HAS_AABBS);
        at = s->aabbs;
    } else if ((assumed & RTC_FACT_HAS_TRIANGLES) && s->triangles != ~0u) {
        a = find(RTC_FACT_HAS_TRIANGLES);
        at = s->triangles;
    } else if ((assumed & RTC_FACT_ALL_OPAQUE) && s->not_opaque != ~0u && !flags) {
        a = find(RTC_FACT_ALL_OPAQUE);
        at = s->not_opaque;
        snprintf(geometry, sizeof geometry, "geometry %u of ", s->not_opaque_geometry);
    }
    if (!a) return VK_SUCCESS;
    return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "assumption",
                     "the module assumes '%s', but %sstructure %u of rtrCmdDeclareScene %s: %s, or compile without "
                     "--assume=%s",
                     a->name, geometry, at, a->broken, a->remedy, a->name);
}

VkResult rtr_check_scene_heap(RtrRecorder r, const struct RtrPipeline_T* p) {
    const RtrDeclaredScene* s = &r->scene;
    const bool addresses = p->header.flags & RTC_MODULE_ADDRESS_MODE;
    const uint32_t wanted = addresses ? 0 : r->heap ? r->heap->id : 0;
    uint32_t at;
    /* A module that traces nothing in heap mode has no heap. */
    if (!s->bound || (!addresses && !(p->header.used_bindings >> RTC_BINDING_HEAP_TEXELS & 3))) return VK_SUCCESS;
    if (s->heap == wanted && s->elsewhere == ~0u) return VK_SUCCESS;
    at = s->heap == wanted ? s->elsewhere : s->at;
    return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "other-heap",
                     "structure %u of rtrCmdDeclareScene does not lie %s: no ray of this launch can reach it", at,
                     addresses ? "at a device address, where this module (--addressing=address) looks"
                               : "in the heap of rtrCmdSetHeap");
}

/* ---- Scene profiles ------------------------------------------------------------------------ */

typedef struct Text {
    char* out; /* NULL: only counted */
    size_t room, size;
} Text;

static void put(Text* t, const char* s) {
    for (; *s; s++) {
        if (t->out && t->size < t->room) t->out[t->size] = *s;
        t->size++;
    }
}

VkResult rtrWriteSceneProfile(RtrDevice d, uint32_t count, const void* const* headers, size_t* pSize, char* text) {
    Text t = {text, text ? *pSize : 0, 0};
    uint32_t hold = ~0u, i;
    bool first = true;
    char line[128];
    size_t k;
    for (i = 0; i < count; i++) {
        uint32_t w[RTC_HDR_OFFENDERS_END];
        memcpy(w, headers[i], sizeof w);
        if (w[RTC_HDR_MAGIC] != RTC_AS_MAGIC || w[RTC_HDR_KIND] != RTC_AS_KIND_TOP)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "scene-profile",
                             "header %u is not that of a built top level (magic 0x%x, kind %u)", i,
                             w[RTC_HDR_MAGIC], w[RTC_HDR_KIND]);
        hold &= w[RTC_HDR_FACTS] ^ RTC_FACTS_OF_ABSENCE;
    }
    if (!count)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "scene-profile", "no top level: nothing to profile");
    /* A scene of neither triangles nor AABBs says nothing about what others hold. */
    if ((hold & RTC_FACTS_OF_ABSENCE) == RTC_FACTS_OF_ABSENCE) hold &= ~RTC_FACTS_OF_ABSENCE;
    put(&t, "{\n  \"rtcSceneProfile\": 1,\n  \"assume\": [");
    for (k = 0; k < ASSUMPTIONS; k++) {
        if (!(hold & k_assumptions[k].bit)) continue;
        put(&t, first ? "\"" : ", \"");
        put(&t, k_assumptions[k].name);
        put(&t, "\"");
        first = false;
    }
    put(&t, "],\n  \"topLevels\": [");
    for (i = 0; i < count; i++) {
        uint32_t w[RTC_HDR_OFFENDERS_END];
        memcpy(w, headers[i], sizeof w);
        snprintf(line, sizeof line, "%s\n    {\"instances\": %u, \"active\": %u, \"depth\": %u}", i ? "," : "",
                 w[RTC_HDR_PRIMITIVE_COUNT], w[RTC_HDR_ACTIVE_COUNT], w[RTC_HDR_MAX_DEPTH]);
        put(&t, line);
    }
    put(&t, "\n  ]\n}\n");
    *pSize = t.size;
    return text && t.size > t.room ? VK_INCOMPLETE : VK_SUCCESS;
}
