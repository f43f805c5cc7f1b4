// What the stages of this set share.
#define SKY vec3(0.4, 0.6, 1.0)

struct Surface {
    vec3 color;
    float distance;
};
