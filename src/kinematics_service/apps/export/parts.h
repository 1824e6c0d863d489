// SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
// SPDX-License-Identifier: Apache-2.0
//
// The parts of a header that do not follow from the kernel's source. header.py puts words in the
// place of the names between two @. A line with the name of a part begins each part.
//// head
// @robot@: kinematics in @language@, written by kinematics_service @version@.
// @source@
// The code is from kinematics_service and has its licence, Apache-2.0. Sine and cosine in double
// have the coefficients of fdlibm (Sun Microsystems, 1993).
//
// q: @dof@ joint positions (@units@): @joints@.
// T: the pose of a frame in the base frame, 3 x 4 numbers row by row; lengths in m.
// J: the Jacobian of this frame, 6 x @dof@ numbers row by row: vx vy vz wx wy wz of its origin,
// in base axes.
// twist: vx vy vz wx wy wz of the tool, likewise.
// frames: the poses of the table's frame 0 and of the frame after each row.
// The arrays of a call must not overlap.
//
@notes@
// If a joint position is not finite, all results of a function are NaN.
// Self-test: @before@self_test() returns the number of wrong numbers at @poses@ poses.
#ifndef @guard@
#define @guard@

#include <float.h>
#include <math.h>

#if defined(__FAST_MATH__) || FLT_EVAL_METHOD == 2 || FLT_EVAL_METHOD < 0
#error "compile without -ffast-math, and for a processor that does not widen numbers"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#if defined(__FMA__)
// GCC 12 fuses alternating sums and differences of vectors against the option above.
#pragma GCC optimize("no-tree-slp-vectorize")
#endif
#endif

@begin@
@counts@
@constant@ const @real@ @before@lower_limits[] = @lower_limits@;
@constant@ const @real@ @before@upper_limits[] = @upper_limits@;
@constant@ const @real@ @before@velocity_limits[] = @velocity_limits@;
@constant@ const char *const @before@joint_names[] = {@joint_names@};

typedef struct { double at[2]; } @prefix@pair;
typedef struct { double at[3]; } @prefix@triple;

static inline int @prefix@all_finite(const @real@ *numbers, int count)
{
    @real@ nothing = 0;
    for (int k = 0; k < count; ++k) {
        nothing += 0 * numbers[k];
    }
    return nothing == 0;
}

static inline void @prefix@no_result(@real@ *results, int count)
{
    for (int k = 0; k < count; ++k) {
        results[k] = NAN;
    }
}

static inline void @prefix@copy(double *to, int count, const double *numbers)
{
    for (int k = 0; k < count; ++k) {
        to[k] = numbers[k];
    }
}

static inline void @prefix@fill(double *to, int count, double number)
{
    for (int k = 0; k < count; ++k) {
        to[k] = number;
    }
}

//// double
// Results have the bits of kinematics_service; in_axes_of agrees with it to round-off. g++ and
// clang++ fuse no operations here; give other compilers an option like -ffp-contract=off. Beyond
// @largest@ rad, sine and cosine are those of the C library, which differ between systems.
//// float
// Numbers are float. They differ from those of kinematics_service by at most @T_error@ in T and
// @J_error@ in J inside the joint limits. This is twice the largest difference at 1000
// poses. It is measured and not proved.
//// loops
// If a loop does not close, all results are NaN, too. Closed loops are solved in steps from
// positions at which they close. The time of a call grows with the distance from these positions,
// and is longest where a loop does not close.
//// sines of double
static inline void @prefix@sines_and_cosines(const double *angle, int count, double *s, double *c)
{
    int beyond = 0;
    for (int k = 0; k < count; ++k) {
        beyond |= !(fabs(angle[k]) <= @largest@);
    }
    if (beyond) {
        for (int k = 0; k < count; ++k) {
            const @prefix@pair both = @sincos@;
            s[k] = both.at[0];
            c[k] = both.at[1];
        }
        return;
    }
    for (int k = 0; k < count; ++k) {
        const @prefix@pair both = @sincos_reduced@;
        s[k] = both.at[0];
        c[k] = both.at[1];
    }
}

//// sines of float
static inline void @prefix@sines_and_cosines(const float *angle, int count, float *s, float *c)
{
    for (int k = 0; k < count; ++k) {
        s[k] = sinf(angle[k]);
        c[k] = cosf(angle[k]);
    }
}

//// function
static inline void @before@@name@(@parameters@)
{
@body@
}

//// factors
@constant@ const char *const @before@factor_names[] = {@factor_names@};

@function@
//// measures
// J_axes: J in the axes of the frame with the pose T, instead of base axes.
static inline void @before@in_axes_of(const @real@ *T, const @real@ *J, @real@ *J_axes)
{
    for (int row = 0; row < 6; ++row) {
        const @real@ *axis = T + row % 3, *v = J + row / 3 * 3 * @dof@;
        for (int k = 0; k < @dof@; ++k, ++v) {
            *J_axes++ = axis[0] * v[0] + axis[4] * v[@dof@] + axis[8] * v[2 * @dof@];
        }
    }
}

static inline void @prefix@measure(const @real@ *J, double *measures)
{
    double copy[@columns@], W[@W@], spare[@columns@], sigma[6];
    for (int k = 0; k < @columns@; ++k) {
        copy[k] = J[k];
    }
    @write_scalars@;
}

// The product of the singular values of the rows @task@ of the Jacobian J of the tool.
static inline double @before@manipulability(const @real@ *J)
{
    double measures[@measures@];
    @prefix@measure(J, measures);
    return measures[@manipulability@];
}

// The smallest singular value of these rows, with angular rows@and_columns@ times @length@ m.
static inline double @before@smallest_singular_value(const @real@ *J)
{
    double measures[@measures@];
    @prefix@measure(J, measures);
    return measures[@smallest@];
}

//// end
static inline int @before@self_test(void)
{
    static const @real@ q[] = @q_tested@;
    static const double expected_T[] = @T_tested@;
    static const double expected_J[] = @J_tested@;
    int wrong = 0;
    for (int k = 0; k < @poses@; ++k) {
        @real@ T[12], J[@columns@];
        @before@jacobian(q + @dof@ * k, T, J);
        for (int i = 0; i < 12; ++i) {
            wrong += !(fabs(T[i] - expected_T[12 * k + i]) <= @T_error@);
        }
        for (int i = 0; i < @columns@; ++i) {
            wrong += !(fabs(J[i] - expected_J[@columns@ * k + i]) <= @J_error@);
        }
    }
    return wrong;
}

@end@
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif

#endif
