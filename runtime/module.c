/* Reads a linked module: its reflection (OpString chunks, abi.h) and how many
 * descriptors of each kind it declares. Nothing in it is trusted. */
#include "internal.h"

#define SPIRV_MAGIC 0x07230203u
#define MAX_CHUNKS 4096u
static const char k_prefix[] = "rtc.reflection:";

typedef struct Chunk {
    const char* text; /* base64, in the module */
    size_t size;
} Chunk;

static VkResult damaged(RtrDevice d, const char* what) {
    return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "module", "module: %s", what);
}

/* Reads decimal digits; false without any or beyond MAX_CHUNKS. */
static bool number(const char** at, const char* end, uint32_t* value) {
    const char* p = *at;
    uint32_t v = 0;
    if (p == end || *p < '0' || *p > '9') return false;
    for (; p < end && *p >= '0' && *p <= '9'; p++) {
        v = 10 * v + (uint32_t)(*p - '0');
        if (v > MAX_CHUNKS) return false;
    }
    *at = p;
    *value = v;
    return true;
}

static int sextet(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+') return 62;
    if (c == '/') return 63;
    return -1;
}

/* Appends the bytes of one chunk; false when it is not base64. */
static bool decode(const Chunk* chunk, uint8_t* out, size_t* size) {
    size_t i, at = *size;
    if (chunk->size % 4) return false;
    for (i = 0; i < chunk->size; i += 4) {
        const char* q = chunk->text + i;
        const bool last = i + 4 == chunk->size;
        int pad = last ? (q[3] == '=') + (q[3] == '=' && q[2] == '=') : 0, k, v;
        uint32_t group = 0;
        for (k = 0; k < 4; k++) {
            v = k >= 4 - pad ? 0 : sextet(q[k]);
            if (v < 0) return false;
            group = group << 6 | (uint32_t)v;
        }
        out[at++] = (uint8_t)(group >> 16);
        if (pad < 2) out[at++] = (uint8_t)(group >> 8);
        if (pad < 1) out[at++] = (uint8_t)group;
    }
    *size = at;
    return true;
}

/* ---- Descriptors -------------------------------------------------------------------- */

typedef enum IdKind {
    ID_NONE,
    ID_CONSTANT, /* value in a */
    ID_STRUCT,   /* a: BufferBlock */
    ID_SAMPLER,
    ID_SAMPLED,
    ID_STORAGE_IMAGE,
    ID_INPUT_ATTACHMENT,
    ID_COMBINED,
    ID_ARRAY,  /* a: element, b: length */
    ID_POINTER /* a: pointee, b: storage class */
} IdKind;

typedef struct Id {
    uint8_t kind;
    uint8_t buffer_block;
    uint32_t a, b;
} Id;

static void count_variable(RtrModule* m, const Id* ids, uint32_t bound, uint32_t pointer_type) {
    uint32_t type, elements = 1, depth;
    uint32_t* counter = NULL;
    if (pointer_type >= bound || ids[pointer_type].kind != ID_POINTER) return;
    type = ids[pointer_type].a;
    for (depth = 0; depth < 8 && type < bound && ids[type].kind == ID_ARRAY; depth++) {
        if (ids[type].b) elements *= ids[type].b;
        type = ids[type].a;
    }
    if (type >= bound) return;
    switch (ids[pointer_type].b) {
        case 12:
            counter = &m->storage_buffers;
            break;
        case 2:
            counter = ids[type].buffer_block ? &m->storage_buffers : &m->uniform_buffers;
            break;
        case 0:
            switch (ids[type].kind) {
                case ID_SAMPLER:
                    counter = &m->samplers;
                    break;
                case ID_SAMPLED:
                    counter = &m->sampled_images;
                    break;
                case ID_STORAGE_IMAGE:
                    counter = &m->storage_images;
                    break;
                case ID_INPUT_ATTACHMENT:
                    counter = &m->input_attachments;
                    break;
                case ID_COMBINED:
                    m->samplers += elements;
                    counter = &m->sampled_images;
                    break;
                default:
                    break;
            }
            break;
        default:
            break;
    }
    if (!counter) return;
    *counter += elements;
    if (ids[type].kind != ID_SAMPLER) m->total += elements;
}

/* Declarations come before uses in the sections walked here, so one pass is enough. */
static void walk_types(RtrModule* m, Id* ids, uint32_t bound, const uint32_t* code, size_t words) {
    size_t at;
    for (at = 5; at < words;) {
        uint32_t length = code[at] >> 16, op = code[at] & 0xffffu;
        const uint32_t* w = code + at;
        if (length == 0 || length > words - at) return;
        at += length;
        if (op == 54) return; /* OpFunction: no declarations after it */
        if (op == 71 && length >= 3 && w[1] < bound && w[2] == 3)
            ids[w[1]].buffer_block = 1; /* OpDecorate BufferBlock */
        if (length < 2) continue;
        if (op == 43) { /* OpConstant */
            if (length >= 4 && w[2] < bound) ids[w[2]].kind = ID_CONSTANT, ids[w[2]].a = w[3];
            continue;
        }
        if (op == 59) { /* OpVariable */
            if (length >= 4) count_variable(m, ids, bound, w[1]);
            continue;
        }
        if (w[1] >= bound) continue;
        switch (op) {
            case 25: /* OpTypeImage: result, sampled type, dim, depth, arrayed, ms, sampled */
                if (length < 8) break;
                ids[w[1]].kind = w[3] == 6 ? ID_INPUT_ATTACHMENT : w[7] == 2 ? ID_STORAGE_IMAGE : ID_SAMPLED;
                break;
            case 26:
                ids[w[1]].kind = ID_SAMPLER;
                break;
            case 27:
                ids[w[1]].kind = ID_COMBINED;
                break;
            case 28: /* OpTypeArray */
                if (length < 4) break;
                ids[w[1]].kind = ID_ARRAY;
                ids[w[1]].a = w[2];
                ids[w[1]].b = w[3] < bound && ids[w[3]].kind == ID_CONSTANT ? ids[w[3]].a : 1;
                break;
            case 29: /* OpTypeRuntimeArray */
                if (length < 3) break;
                ids[w[1]].kind = ID_ARRAY;
                ids[w[1]].a = w[2];
                ids[w[1]].b = 1;
                break;
            case 30:
                ids[w[1]].kind = ID_STRUCT;
                break;
            case 32: /* OpTypePointer */
                if (length < 4) break;
                ids[w[1]].kind = ID_POINTER;
                ids[w[1]].a = w[3];
                ids[w[1]].b = w[2];
                break;
            default:
                break;
        }
    }
}

/* ---- Reflection ----------------------------------------------------------------------- */

static VkResult collect(RtrDevice d, const uint32_t* code, size_t words, Chunk* chunks, uint32_t* count,
                        size_t* bytes) {
    const size_t prefix = sizeof k_prefix - 1;
    uint32_t found = 0, i;
    size_t at;
    *count = 0;
    *bytes = 0;
    for (at = 5; at < words;) {
        uint32_t length = code[at] >> 16, op = code[at] & 0xffffu;
        if (length == 0 || length > words - at) return damaged(d, "truncated instruction");
        if (op == 7 && length > 2) { /* OpString */
            const char* text = (const char*)(code + at + 2);
            const char* end = memchr(text, 0, (length - 2) * 4);
            uint32_t index, total;
            if (!end) return damaged(d, "an OpString does not end");
            if ((size_t)(end - text) > prefix && memcmp(text, k_prefix, prefix) == 0) {
                text += prefix;
                if (!number(&text, end, &index) || text == end || *text++ != '/' ||
                    !number(&text, end, &total) || text == end || *text++ != ':' || index >= total ||
                    total > MAX_CHUNKS || (*count && total != *count) || chunks[index].text)
                    return damaged(d, "its reflection is damaged");
                *count = total;
                chunks[index].text = text;
                chunks[index].size = (size_t)(end - text);
                *bytes += chunks[index].size;
                found++;
            }
        }
        at += length;
    }
    if (!found)
        return damaged(d, "it carries no rtc reflection (not linked by rtc, or its strings were stripped)");
    for (i = 0; i < *count; i++)
        if (!chunks[i].text) return damaged(d, "a part of its reflection is missing");
    return VK_SUCCESS;
}

static VkResult unpack(RtrDevice d, const uint8_t* bytes, size_t size, const VkAllocationCallbacks* a,
                       RtrModule* m) {
    RtcModuleHeader* h = &m->header;
    size_t groups;
    if (size < sizeof *h) return damaged(d, "its reflection is too short");
    memcpy(h, bytes, sizeof *h);
    if (h->magic != RTC_MODULE_MAGIC) return damaged(d, "its reflection has another magic number");
    if (h->abi_version != RTC_ABI_VERSION)
        return rtr_error(
            d, VK_ERROR_INCOMPATIBLE_DRIVER, "abi-version",
            "module has rtc ABI version %u, this runtime %u: link it again with the matching compiler",
            h->abi_version, RTC_ABI_VERSION);
    groups = (size_t)h->group_count * sizeof(RtcModuleGroup);
    if (h->group_count > (1u << 24) || groups > size - sizeof *h || h->json_bytes > size - sizeof *h - groups)
        return damaged(d, "its reflection is shorter than its header says");
    if (h->reserved_set > 31 || h->reserved_binding > (1u << 24) || h->scratch_words > (1u << 20))
        return damaged(d, "its reflection holds impossible numbers");
    if (h->flags & RTC_MODULE_ADDRESS_MODE && !d->get_buffer_device_address)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "address-mode",
                         "module was linked for address mode, but the RtrDevice was created without "
                         "bufferDeviceAddress; link it with --addressing=heap, or enable the feature");
    m->groups = rtr_alloc(a, groups);
    m->json = rtr_alloc(a, (size_t)h->json_bytes + 1);
    if (!m->groups || !m->json) return VK_ERROR_OUT_OF_HOST_MEMORY;
    memcpy(m->groups, bytes + sizeof *h, groups);
    memcpy(m->json, bytes + sizeof *h + groups, h->json_bytes);
    return VK_SUCCESS;
}

VkResult rtr_parse_module(RtrDevice d, const uint32_t* code, size_t size, const VkAllocationCallbacks* a,
                          RtrModule* m) {
    const size_t words = size / 4;
    Chunk* chunks = NULL;
    Id* ids = NULL;
    uint8_t* bytes = NULL;
    uint32_t count = 0, i;
    size_t encoded = 0, used = 0;
    VkResult r;
    memset(m, 0, sizeof *m);
    if (!code || words < 5 || size % 4 || code[0] != SPIRV_MAGIC)
        return damaged(d, "not SPIR-V of this machine's byte order");
    if (code[3] == 0 || code[3] > (1u << 24)) return damaged(d, "impossible id bound");
    chunks = rtr_alloc(a, (MAX_CHUNKS + 1) * sizeof *chunks);
    ids = rtr_alloc(a, code[3] * sizeof *ids);
    r = chunks && ids ? collect(d, code, words, chunks, &count, &encoded) : VK_ERROR_OUT_OF_HOST_MEMORY;
    if (r == VK_SUCCESS) {
        bytes = rtr_alloc(a, encoded + 4);
        if (!bytes) r = VK_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (i = 0; r == VK_SUCCESS && i < count; i++)
        if (!decode(&chunks[i], bytes, &used)) r = damaged(d, "its reflection is not base64");
    if (r == VK_SUCCESS) r = unpack(d, bytes, used, a, m);
    if (r == VK_SUCCESS) walk_types(m, ids, code[3], code, words);
    rtr_free(a, bytes);
    rtr_free(a, ids);
    rtr_free(a, chunks);
    if (r != VK_SUCCESS) rtr_free_module(a, m);
    return r;
}

void rtr_free_module(const VkAllocationCallbacks* a, RtrModule* m) {
    rtr_free(a, m->groups);
    rtr_free(a, m->json);
    m->groups = NULL;
    m->json = NULL;
}
