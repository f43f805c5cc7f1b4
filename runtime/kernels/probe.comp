#version 450
#extension GL_GOOGLE_include_directive : require
// What the device's float arithmetic does. Operands come from memory, so that nothing is
// folded. In: state[0..7] as floats; out: state[8..15] (see rtrDecodeFloatProbe).
#include "common.glsl"

// Not marked precise on purpose: what the driver does with ordinary code.
float unmarked(float a, float b, float c) { return a * b + c; }
float marked(float a, float b, float c) {
    precise float r = a * b;
    precise float s = r + c;
    return s;
}

void main() {
    if (gl_LocalInvocationIndex != 0u) return;
    // The push constants carry the operands: words, not data of the application.
    float one_eps = uintBitsToFloat(p.count);    // 1 + 2^-12
    float minus = uintBitsToFloat(p.total);      // -(1 + 2^-11)
    float tiny = uintBitsToFloat(p.first);       // 2^-126
    float half_ = uintBitsToFloat(p.primitive_base); // 0.5
    float three = uintBitsToFloat(p.geometry);   // 3
    float nan_ = uintBitsToFloat(p.data_offset);
    float ulp = uintBitsToFloat(p.data_stride);  // 2^-24: half an ulp of 1
    state[0] = floatBitsToUint(unmarked(one_eps, one_eps, minus));
    state[1] = floatBitsToUint(marked(one_eps, one_eps, minus));
    state[2] = floatBitsToUint(fma(one_eps, one_eps, minus));
    precise float d = tiny * half_;
    state[3] = floatBitsToUint(d);
    // 1 + 2^-24 is a tie: to even gives 1; (1 + 2^-23) + 2^-24 gives 1 + 2^-22.
    precise float a = 2.0 * half_ + ulp;
    precise float b = (2.0 * half_ + 2.0 * ulp) + ulp;
    state[4] = floatBitsToUint(a);
    state[5] = floatBitsToUint(b);
    precise float t = (2.0 * half_) / three;
    precise float s = (2.0 * half_) / (2.0 * three + 2.0 * half_);
    state[6] = floatBitsToUint(t);
    state[7] = floatBitsToUint(s);
    precise float z = -half_ * 0.0;
    precise float zz = z * half_;
    state[8] = floatBitsToUint(zz);
    state[9] = (nan_ < three ? 1u : 0u) | (nan_ >= three ? 2u : 0u);
    for (uint i = 10u; i < 16u; i++) state[i] = 0u;
}
