/* SPDX-License-Identifier: MIT */
/*
 * track.h — frequency, damping and gain of up to three modes, followed while the model runs. Nothing of it reaches the model.
 *
 * The residual of a model whose mode m has moved is, beside noise and an offset, the motion e_m that the moved mode has more than the
 * model's. With the model's pole λ₀, its motion z (complex amplitude, heard as Re z) and its coupling b₀ to the drive:
 *     ν = r − d − Σ Re e,    e ← λ e + (λ − λ₀) z + (b − b₀) u + κ ν,    d ← d + κ_d ν
 *     λ = λ₀ (1 + c/2)/(1 − c/2),    b = g b₀/(1 − c/2),    c = i f θ₀ − s θ₁,    g = 1 + 0.3 θ₂
 * θ is found by a recursive prediction-error method: with ψ = −∂ν/∂θ, by its own recursion of the same form, a Kalman filter for
 * θ that wanders: at the start each θ is 0 ± 1 (a tenth of the frequency, all of the damping, 0.3 of the gain), and within wander_s it
 * may go as far again. A mode is learnt from only while it moves by more than the noise; five innovations count as one, since they are not
 * white while anything is wrong, and none counts that is above three times their running rms: a push. All of it is for a model that was right and
 * drifts: one that leaves twenty times the noise elsewhere pulls the modes along, and innovation_rms says so. θ stays within its limits, its covariance within 1e-7 to 1.
 *
 * Its state has no memory of its own: it lies in what the plan's filters leave of the step's pool of remembered samples. So it begins
 * anew whenever the model is put to rest.
 */
#ifndef TRACK_H
#define TRACK_H

#include "beam_image.h"
#include "beam_wire.h"

struct track_mode {
    float e[2];
    float slope[3][2]; /* ∂e/∂θ */
    float theta[3];
    float covariance[6]; /* of θ: 00 01 02 11 12 22, for innovations of rms 1 */
};

struct track {
    float samples; /* since the model was at rest, up to 2²⁴ */
    float square;  /* running mean square of the innovations, each cut */
    float offset;
    struct track_mode mode[BEAM_TRACKED];
};
_Static_assert(sizeof(struct track) == BEAM_TRACK_WORDS * sizeof(float), "words of the pool");

/* In the state's pool; NULL when the image does not ask for it. */
struct track *track_of(const struct beam_image *image, struct beam_state *state);

/*
 * After the step whose residual this is; `hears`: the sensor is in order, else nothing is learnt. Sample interrupt.
 * Cost: about 120 instructions and 380 a mode, and 320 in the first sample.
 */
void track_sample(const struct beam_image *image, struct beam_state *state, float residual, bool hears);

/* What is known now, in physical units; background. */
void track_report(const struct beam_image *image, const struct track *track, struct beam_tracking *out);

#endif
