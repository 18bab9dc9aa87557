/* A joint with a state, two modes and two event indicators, to test the wrapper with. */
#ifndef JOINT_SIZES_H
#define JOINT_SIZES_H

enum {
    JL_VARIABLES = 15,
    JL_INPUTS = 2,
    JL_OUTPUTS = 1,
    JL_PARAMETERS = 7,
    JL_STRUCTURE = 0,
    JL_JOINTS = 1,
    JL_STATES = 1,
    JL_CONTINUOUS = 1,
    JL_MODES = 2,
    JL_INDICATORS = 2,
    JL_EXCHANGE = 1,
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
