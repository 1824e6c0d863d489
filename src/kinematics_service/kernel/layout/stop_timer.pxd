# What a handler of signals may do: alarm, sigaction and _exit are safe there (POSIX.1-2024, 2.4.3).
cdef extern from *:
    """
    #include <errno.h>
    #include <signal.h>
    #include <unistd.h>
    static volatile sig_atomic_t stop_timer_signal, stop_timer_seconds;
    static PyOS_sighandler_t stop_timer_before[32];

    static void stop_timer_end(int number) { _exit(128 + stop_timer_signal); }

    static void stop_timer_take(int number) {
        int error = errno;
        if (!stop_timer_signal) {
            stop_timer_signal = number;
            PyOS_setsig(SIGALRM, stop_timer_end);
            alarm(stop_timer_seconds);
        }
        stop_timer_before[number](number);
        errno = error;
    }

    static void stop_timer_start_at(int number, int seconds) {
        PyOS_sighandler_t before = PyOS_setsig(number, stop_timer_take);
        if (before != stop_timer_take) stop_timer_before[number] = before;
        stop_timer_signal = 0;
        stop_timer_seconds = seconds;
    }
    """
    void start_at "stop_timer_start_at"(int, int) noexcept nogil
