/* Preloaded into a CARLA client: loses some of the signals that its main thread sends to its
 * Traffic Manager, as happens on a busy machine. LOSE_EVERY says which. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

static int sent;

static int is_from_client(void *caller) {
    Dl_info place;
    return syscall(SYS_gettid) == getpid() && dladdr(caller, &place) && place.dli_fname
        && strstr(place.dli_fname, "libcarla");
}

int pthread_cond_signal(pthread_cond_t *condition) {
    int (*signal)(pthread_cond_t *) = dlvsym(RTLD_NEXT, "pthread_cond_signal", "GLIBC_2.3.2");
    if (is_from_client(__builtin_return_address(0)) && ++sent % atoi(getenv("LOSE_EVERY")) == 0) {
        fprintf(stderr, "lost signal %d\n", sent);
        return 0;
    }
    return signal(condition);
}
