/* Lavapipe of Mesa 22.3 makes every memory barrier that is wider than a subgroup a control barrier of the
 * workgroup: also those of atomics that order memory, and of loads and stores that make available or visible.
 * Lanes that end, or turn elsewhere, without passing it then end the others without a word. Its lanes are
 * lanes and threads of one CPU, and what keeps memory in order there is that its compiler does not move
 * accesses over the barrier, whatever the scope: so scopes become the subgroup's. */
#include "internal.h"

enum {
    OP_TYPE_INT = 21,
    OP_LOAD = 61,
    OP_STORE = 62,
    OP_COPY_MEMORY = 63,
    OP_IMAGE_READ = 98,
    OP_IMAGE_WRITE = 99,
    OP_MEMORY_BARRIER = 225,
    OP_ATOMIC_LOAD = 227,
    OP_ATOMIC_STORE = 228,
    OP_ATOMIC_LAST = 242,
    OP_ATOMIC_FMIN = 5614,
    OP_ATOMIC_FMAX = 5615,
    OP_ATOMIC_FADD = 6035
};

/* Scopes behind a mask of memory operands (`image` false) or image operands, in the words from `at` on. */
static void narrow_operands(uint32_t* w, uint32_t words, uint32_t at, bool image, uint32_t scope) {
    uint32_t mask, bit;
    if (at >= words) return;
    mask = w[at++];
    for (bit = 1; bit && at < words; bit <<= 1) {
        if (!(mask & bit)) continue;
        if (image) {
            if (bit == 0x100 || bit == 0x200) w[at] = scope; /* make texel available, visible */
            if (bit == 0x4) at++;                            /* gradients are two */
            if (bit < 0x400) at++;
        } else if (bit == 0x2 || bit == 0x8 || bit == 0x10) {
            if (bit != 0x2) w[at] = scope; /* make pointer available, visible */
            at++;
        }
    }
}

static void narrow(uint32_t* w, uint32_t words, uint32_t scope) {
    const uint32_t op = w[0] & 0xffff;
    uint32_t at = 0;
    if (op == OP_MEMORY_BARRIER) at = 1;
    if (op == OP_ATOMIC_STORE) at = 2;
    if ((op >= OP_ATOMIC_LOAD && op <= OP_ATOMIC_LAST && op != OP_ATOMIC_STORE) || op == OP_ATOMIC_FMIN ||
        op == OP_ATOMIC_FMAX || op == OP_ATOMIC_FADD)
        at = 4;
    if (at && at < words) w[at] = scope;
    if (op == OP_LOAD) narrow_operands(w, words, 4, false, scope);
    if (op == OP_STORE || op == OP_COPY_MEMORY) narrow_operands(w, words, 3, false, scope);
    if (op == OP_IMAGE_READ) narrow_operands(w, words, 5, true, scope);
    if (op == OP_IMAGE_WRITE) narrow_operands(w, words, 4, true, scope);
}

/* A copy of the module, to be freed; *size grows by a constant. A module without 32-bit integers has no scopes
 * and is copied as it is. */
uint32_t* rtr_narrow_scopes(const uint32_t* code, size_t* size, const VkAllocationCallbacks* a) {
    const size_t count = *size / 4;
    uint32_t* out = rtr_alloc(a, *size + 16);
    uint32_t scope = 0;
    size_t from, to = 5;
    if (!out || count < 5) return out;
    memcpy(out, code, 20);
    for (from = 5; from < count;) {
        const uint32_t words = code[from] >> 16;
        if (!words || words > count - from) break;
        memcpy(out + to, code + from, 4 * (size_t)words);
        if (scope) narrow(out + to, words, scope);
        to += words;
        if (!scope && words == 4 && (code[from] & 0xffff) == OP_TYPE_INT && code[from + 2] == 32) {
            scope = out[3]++;
            out[to++] = 4u << 16 | 43u; /* OpConstant */
            out[to++] = code[from + 1];
            out[to++] = scope;
            out[to++] = 3; /* Subgroup */
        }
        from += words;
    }
    *size = 4 * to;
    return out;
}
