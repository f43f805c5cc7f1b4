layout(push_constant) uniform Push {
    vec4 eye, right, up, forward;
    vec4 transform[3]; // rows of the instance's object to world matrix
    float instance, material, mirror, cutout;
} push;
