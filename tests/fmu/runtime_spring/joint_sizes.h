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
    JL_LOADED = 0
};

#endif
