/* A joint without states, modes or events: the least that the wrapper must take. */
#ifndef JOINT_SIZES_H
#define JOINT_SIZES_H

enum {
    JL_VARIABLES = 5,
    JL_INPUTS = 2,
    JL_OUTPUTS = 1,
    JL_PARAMETERS = 1,
    JL_STRUCTURE = 0,
    JL_JOINTS = 1,
    JL_STATES = 0,
    JL_CONTINUOUS = 0,
    JL_MODES = 0,
    JL_INDICATORS = 0,
    JL_EXCHANGE = 0,
    JL_LOADED = 0,
    JL_POLES = 0,
    JL_BASIS = 0,
    JL_READS = 0,
    JL_BENT = 0,
    JL_PORTS = 0,
    JL_KEPT = 0,
    JL_STIFF = 0,
    JL_BENT_BY_VELOCITY = 0,
    JL_TURNS = 0,
    JL_HALVED = 0
};

#endif
