/* What a flight controller does with a pack: flight_controller PACK KEY LEG BATTERY */
#include <stdio.h>
#include <stdlib.h>

#include "skyway_pack.h"

/* ... from its own flash. */
static size_t load(const char *path, uint8_t *into, size_t room) {
    FILE *file = fopen(path, "rb");
    size_t length = file == NULL ? 0 : fread(into, 1, room, file);
    if (file != NULL) {
        fclose(file);
    }
    return length;
}

int main(int count, char **arguments) {
    static uint8_t bytes[65536];
    uint8_t key[32];
    skyway_pack pack;
    skyway_plan plan;
    skyway_way way;
    if (count != 5 || load(arguments[2], key, sizeof key) != sizeof key) {
        return 2;
    }
    size_t length = load(arguments[1], bytes, sizeof bytes);

    /* Once, when the pack comes: a pack that is not as it was signed is never flown by. */
    int error = skyway_pack_read(bytes, length, key, &pack);
    if (error != SKYWAY_OK) {
        printf("refused: %d\n", error);
        return 1;
    }
    skyway_pack_plan(&pack, &plan);
    printf("%s version %u, %u legs\n", plan.plan, (unsigned)plan.version, (unsigned)plan.leg_count);

    /* At the first node of a leg that the drone's own senses find closed, without a line to the edge. */
    uint16_t leg = (uint16_t)atoi(arguments[3]);
    uint16_t battery_e4 = (uint16_t)atoi(arguments[4]);
    switch (skyway_pack_if_closed(&pack, leg, battery_e4, &way)) {
    case SKYWAY_DETOUR:
        printf("detour:");
        break;
    case SKYWAY_ALTERNATE:
        printf("alternate:");
        break;
    case SKYWAY_UNKNOWN: /* hover or land as the controller does without Skyway */
        printf("nothing known\n");
        return 0;
    default:
        return 1;
    }
    for (uint8_t number = 0; number < way.hop_count; number++) {
        skyway_hop hop;
        if (skyway_pack_hop(&pack, &way, number, &hop) != SKYWAY_OK) {
            return 1;
        }
        printf(" %u (%d, %d)", (unsigned)hop.to.index, (int)hop.to.lon_e7_or_x_cm, (int)hop.to.lat_e7_or_y_cm);
    }
    if (way.rejoins == SKYWAY_NONE_16) {
        printf(", land\n");
    } else {
        printf(", on with leg %u\n", (unsigned)way.rejoins);
    }
    return 0;
}
