// What the stages of the spawn campaign tell one another.
struct Spawned {
    RtcSpawn at;
    float t;
    uint primitive; // of the first hit, 0xffffffff: none
    uint self; // candidates of the second ray that are the first hit's triangle
};
