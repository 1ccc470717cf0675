/* SPDX-License-Identifier: MIT */
#include "beam.h"

const char *beam_status_text(enum beam_status status)
{
    switch (status) {
    case BEAM_OK:
        return "done";
    case BEAM_ERROR_ARGUMENT:
        return "a count, kind or index is outside its range; see the sizes in beam.h";
    case BEAM_ERROR_INTERVAL:
        return "the sample interval must be positive and finite";
    case BEAM_ERROR_CAPACITY:
        return "more ports, taps, states or history than this build holds; use a shorter hold or raise BEAM_PORTS, "
               "BEAM_TAPS or BEAM_HISTORY";
    case BEAM_ERROR_EFFECT:
        return "no such effect in this build";
    case BEAM_ERROR_NEEDS_HOST:
        return "this effect changes the space; deploy a reduced model made by the host";
    case BEAM_ERROR_NOT_FINITE:
        return "a number is NaN or infinite";
    case BEAM_ERROR_PARAMETER:
        return "EI and rho must be positive, cDI and gamma not negative";
    case BEAM_ERROR_EFFECT_RANGE:
        return "a parameter of an effect is outside its physical range";
    case BEAM_ERROR_PLACE:
        return "a position lies outside the beam";
    case BEAM_ERROR_ASYMMETRIC:
        return "a matrix is not symmetric";
    case BEAM_ERROR_MASS:
        return "the mass matrix is not positive definite; check densities and added masses";
    case BEAM_ERROR_STIFFNESS:
        return "the stiffness matrix is not positive semidefinite; check EI, springs and axial load";
    case BEAM_ERROR_MEMORY:
        return "a memory form is not positive semidefinite or its relaxation time is not positive";
    case BEAM_ERROR_UNSTABLE:
        return "a mode grows by itself; the damping must take energy out";
    case BEAM_ERROR_DEFECTIVE:
        return "two poles coincide and share their shape; change the damping by a millionth";
    case BEAM_ERROR_FILTER:
        return "an output filter is improper, unstable or looks ahead";
    case BEAM_ERROR_PLAN:
        return "the plan is damaged or unstable; send it again";
    case BEAM_ERROR_SOLVE:
        return "the law equations did not converge in this step; sample faster or soften the law";
    case BEAM_ERROR_STATE:
        return "the state is no longer finite; reset";
    }
    return "unknown status";
}

enum beam_actor beam_status_actor(enum beam_status status)
{
    if (status >= BEAM_OK)
        return BEAM_ACTOR_NOBODY;
    if (status > BEAM_ERROR_NOT_FINITE)
        return BEAM_ACTOR_CALLER;
    return status > BEAM_ERROR_SOLVE ? BEAM_ACTOR_MODEL : BEAM_ACTOR_DEVICE;
}
