/* What a drone does when the line to its edge is gone: reads and checks packs (docs/pack.md).
 *
 * Link with libskyway_pack_c.a. Nothing is allocated, nothing is kept between two calls, and no bytes lead out of
 * bounds. A function gives SKYWAY_OK, or a number below 0, and then fills in nothing.
 */
#ifndef SKYWAY_PACK_H
#define SKYWAY_PACK_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SKYWAY_OK 0
#define SKYWAY_ERROR_NUMBER (-1)     /* there is no leg, or segment, of this number */
#define SKYWAY_ERROR_NULL (-2)       /* a pointer is null */
#define SKYWAY_ERROR_MAGIC (-10)     /* the bytes do not begin as a pack does */
#define SKYWAY_ERROR_FORMAT (-11)    /* a later format */
#define SKYWAY_ERROR_LENGTH (-12)    /* the bytes are fewer or more than they say */
#define SKYWAY_ERROR_FIELD (-13)     /* a field cannot be as it is */
#define SKYWAY_ERROR_KEY (-14)       /* signed with another key */
#define SKYWAY_ERROR_SIGNATURE (-15) /* not as it was signed */

/* What skyway_pack_if_closed says. */
#define SKYWAY_UNKNOWN 0
#define SKYWAY_DETOUR 1
#define SKYWAY_ALTERNATE 2

/* What is known of a contingency. */
#define SKYWAY_PENDING 0  /* it is still being worked out: ask the edge again */
#define SKYWAY_GIVEN 1    /* it is here */
#define SKYWAY_NONE 2     /* there is none */
#define SKYWAY_VOID 3     /* there was one, and something has closed on it */
#define SKYWAY_LEFT_OUT 4 /* a pack cannot say it, or has no room for it */

/* Numbers that say nothing. */
#define SKYWAY_NONE_16 UINT16_MAX
#define SKYWAY_NONE_32 UINT32_MAX
#define SKYWAY_NO_HEIGHT INT16_MIN

/* A pack that was read. It points at the bytes, which have to stay as and where they are. */
typedef struct {
    const uint8_t *bytes;
    size_t length;
} skyway_pack;

typedef struct {
    uint64_t token; /* a drone takes only a higher (token, epoch, version) */
    uint64_t epoch;
    int64_t not_after_ms; /* after this nobody departs by it, in ms of Unix time; in flight it holds on */
    int64_t departs_ms;   /* departure, in ms of Unix time */
    uint32_t version;
    uint16_t leg_count;
    uint8_t clock;             /* 0 the time of day, 1 simulated, 2 moved by a simulator */
    uint8_t height_reference;  /* 0 unknown, 1 ground, 2 mean sea level, 3 ellipsoid of WGS 84 */
    uint8_t is_planar;         /* 1: places are in centimetres on a plane */
    uint8_t is_timed;          /* 0: the edge plans by distance, there are no times and no battery */
    uint8_t has_first_stretch; /* 1: the drone comes to the first node over a stretch that is not here */
    uint8_t network_sha256[32];
    uint8_t key_id[8];
    uint8_t plan[129]; /* id of the plan, UTF-8, ends with a zero */
} skyway_plan;

typedef struct {
    uint32_t index;         /* in the network, as GET /v1/network?format=compact counts from 0 */
    int32_t lon_e7_or_x_cm; /* 1e-7 degrees, or centimetres */
    int32_t lat_e7_or_y_cm;
    int16_t height_dm; /* the height at which it is passed, in decimetres, or SKYWAY_NO_HEIGHT */
} skyway_node;

typedef struct {
    skyway_node from;
    skyway_node to;
    uint32_t departs_ds;     /* leaves `from`, in tenths of a second after the departure, or SKYWAY_NONE_32 */
    uint16_t battery_e4;     /* battery that it takes at `from`, in hundredths of a percent, or SKYWAY_NONE_16 */
    uint8_t dip_from_half_m; /* flown so much below the height of `from` there, in half metres */
    uint8_t dip_to_half_m;
    uint8_t lands_before; /* 1: land at `from` and charge until the battery is battery_e4 */
    uint8_t detour;       /* what is known: SKYWAY_PENDING and so on */
    uint8_t alternate;
} skyway_leg;

typedef struct {
    uint32_t not_before_ds; /* do not take off before, in tenths of a second after the departure, or SKYWAY_NONE_32 */
    uint16_t battery_e4;    /* charge until the battery is this */
    uint8_t stops;          /* 0: there is no stop here */
} skyway_stop;

typedef struct {
    int action;              /* SKYWAY_DETOUR or SKYWAY_ALTERNATE */
    skyway_stop begins_with; /* at the first node, before anything is flown */
    uint16_t leg;            /* it begins at the first node of this leg */
    uint16_t rejoins;        /* at its end the plan is flown on from this leg; SKYWAY_NONE_16: land there */
    uint16_t battery_e4;     /* battery that it takes at its first node, or SKYWAY_NONE_16 */
    uint8_t hop_count;
    uint8_t is_reserve_used; /* 1: it draws on the reserve */
} skyway_way;

/* One segment of a way, straight from node to node. */
typedef struct {
    skyway_node from;
    skyway_node to;
    skyway_stop stop; /* at `to`, before it is flown on */
    uint8_t dip_from_half_m;
    uint8_t dip_to_half_m;
} skyway_hop;

/* Reads a pack, and checks all of it and that this key (32 bytes) has signed it. */
int skyway_pack_read(const uint8_t *bytes, size_t length, const uint8_t key[32], skyway_pack *pack);

/* What it says of the plan as a whole. */
int skyway_pack_plan(const skyway_pack *pack, skyway_plan *plan);

/* A leg, counted from 0. */
int skyway_pack_leg(const skyway_pack *pack, uint16_t number, skyway_leg *leg);

/* What a drone does at the first node of a leg that has closed, with so much battery in hundredths of a percent
 * (SKYWAY_NONE_16: unknown): SKYWAY_DETOUR or SKYWAY_ALTERNATE, and `way` is filled in; SKYWAY_UNKNOWN. */
int skyway_pack_if_closed(const skyway_pack *pack, uint16_t leg, uint16_t battery_e4, skyway_way *way);

/* A segment of a way, counted from 0. */
int skyway_pack_hop(const skyway_pack *pack, const skyway_way *way, uint8_t number, skyway_hop *hop);

#ifdef __cplusplus
}
#endif

#endif
