/* SPDX-License-Identifier: MIT */
/* Free motion of the observed blocks, corrected by what the sensor shows. */
#include "beam_image.h"

#ifdef BEAM_TARGET

float beam_image_observe(const struct beam_image *image, struct beam_observed *observed, float residual)
{
    const struct beam_image_observer *observer = &image->front.observer;
    float expected = observed->offset;
    int n = 0;
    for (uint32_t blocks = observer->blocks; blocks != 0; blocks &= blocks - 1)
        expected += observed->block[n++][0];
    const float innovation = residual - expected;
    observed->offset += observer->gain_offset * innovation;
    n = 0;
    const float *phi = image->plan.x.phi[0];
    for (uint32_t blocks = observer->blocks; blocks != 0; blocks >>= 1, phi += 4) {
        if ((blocks & 1u) == 0)
            continue;
        float *x = observed->block[n];
        const float *gain = observer->gain[n++], a = x[0], b = x[1];
        x[0] = a + (phi[0] * a + phi[1] * b + gain[0] * innovation);
        x[1] = b + (phi[2] * a + phi[3] * b + gain[1] * innovation);
    }
    return innovation;
}

#else

/* ISO C forbids an empty translation unit. */
enum { BEAM_IMAGE_OBSERVER_IS_THE_CONTROLLERS = 1 };

#endif
