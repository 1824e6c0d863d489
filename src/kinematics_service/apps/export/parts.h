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
// @precision@
// If a joint position is not finite@or_loop@, all results of a function are NaN.
@time@// Self-test: @before@self_test() returns the number of wrong numbers at @poses@ poses.
#ifndef @guard@
#define @guard@

@includes@

#if defined(__FAST_MATH__) || FLT_EVAL_METHOD == 2 || FLT_EVAL_METHOD < 0
#error "compile without -ffast-math, and for a processor that does not widen numbers"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#endif
@space@
//// end
@end@#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif

#endif
//// double
Results have the bits of kinematics_service; in_axes_of agrees with it to round-off. g++ and
// clang++ fuse no operations here; give other compilers an option like -ffp-contract=off. Beyond
// @largest@ rad, sine and cosine are those of the C library, which differ between systems.
//// float
Numbers are float. They differ from those of kinematics_service by at most @pose_error@ in T and
// @jacobian_error@ in J inside the joint limits. This is twice the largest difference at 1000
// poses. It is measured and not proved.
//// basics
typedef struct { double at[2]; } @prefix@pair;
typedef struct { double at[3]; } @prefix@triple;

@head@int @prefix@all_finite(const @real@ *numbers, int count)
{
    @real@ nothing = 0;
    for (int k = 0; k < count; ++k) {
        nothing += 0 * numbers[k];
    }
    return nothing == 0;
}

@head@void @prefix@no_result(@real@ *results, int count)
{
    for (int k = 0; k < count; ++k) {
        results[k] = NAN;
    }
}

@head@void @prefix@copy(double *to, int count, const double *numbers)
{
    for (int k = 0; k < count; ++k) {
        to[k] = numbers[k];
    }
}

@head@void @prefix@fill(double *to, int count, double number)
{
    for (int k = 0; k < count; ++k) {
        to[k] = number;
    }
}
//// sines of double
@head@void @prefix@sines_and_cosines(const double *angle, int count, double *s, double *c)
{
    int beyond = 0;
    for (int k = 0; k < count; ++k) {
        beyond |= !(@std@fabs(angle[k]) <= @largest@);
    }
    if (beyond) {
        for (int k = 0; k < count; ++k) {
            const @prefix@pair both = @prefix@sincos(angle[k]);
            s[k] = both.at[0];
            c[k] = both.at[1];
        }
        return;
    }
    for (int k = 0; k < count; ++k) {
        const @prefix@pair both = @prefix@sincos_reduced(angle[k]);
        s[k] = both.at[0];
        c[k] = both.at[1];
    }
}
//// sines of float
@head@void @prefix@sines_and_cosines(const float *angle, int count, float *s, float *c)
{
    for (int k = 0; k < count; ++k) {
        s[k] = @std@sin@f@(angle[k]);
        c[k] = @std@cos@f@(angle[k]);
    }
}
//// evaluate
@head@int @prefix@evaluate_arm(const double *q, const double *qdot, int depth, double *row)
{
    return @prefix@all_finite(q, @dof@) && @prefix@all_finite(qdot, @dof@) &&
        @std@isfinite(@total@);
}
//// measure
// @words@ of the rows @task@ of the Jacobian J of the tool.
@head@double @before@@name@(const @real@ *J)
{
    double copy[@columns@], W[@W@], spare[@spare@], sigma[6], measures[@count@];
    for (int k = 0; k < @columns@; ++k) {
        copy[k] = J[k];
    }
    @prefix@write_scalars(@dof@, &@task_rows@, copy, W, spare, sigma, measures);
    return measures[@at@];
}
//// self-test
@head@int @before@self_test(@void@)
{
@tables@
    int wrong = 0;
    for (int k = 0; k < @poses@; ++k) {
        @real@ T[12], J[@columns@];
        @before@jacobian(q[k], T, J);
        for (int i = 0; i < 12; ++i) {
            wrong += !(@std@fabs(T[i] - expected_T[k][i]) <= @pose_error@);
        }
        for (int i = 0; i < @columns@; ++i) {
            wrong += !(@std@fabs(J[i] - expected_J[k][i]) <= @jacobian_error@);
        }
    }
    return wrong;
}
