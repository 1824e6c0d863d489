# SPDX-FileCopyrightText: 2026 The kinematics_service maintainers
# SPDX-License-Identifier: Apache-2.0
# The signal handler below calls only functions that POSIX allows in handlers: alarm, sigaction and
# _exit (POSIX.1-2024, 2.4.3). Windows has no alarm.
cdef extern from *:
    """
    #ifdef _WIN32
    static void stop_timer_start_at(int number, int seconds) {}
    #else
    #include <signal.h>
    #include <unistd.h>
    static volatile sig_atomic_t stop_timer_first, stop_timer_seconds;
    static PyOS_sighandler_t stop_timer_before[32];
    static void stop_timer_end(int number) { _exit(128 + stop_timer_first); }
    static void stop_timer_take(int number) {
        if (!stop_timer_first) {
            stop_timer_first = number;
            PyOS_setsig(SIGALRM, stop_timer_end);
            alarm(stop_timer_seconds);
        }
        stop_timer_before[number](number);
    }
    static void stop_timer_start_at(int number, int seconds) {
        stop_timer_first = 0;
        stop_timer_seconds = seconds;
        stop_timer_before[number] = PyOS_setsig(number, stop_timer_take);
    }
    #endif
    """
    void start_at "stop_timer_start_at"(int, int) noexcept nogil
