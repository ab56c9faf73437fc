// What newer C libraries offer under newer versions, taken in the versions of the oldest one that Blender
// runs with. A core with these definitions, and with the C++ library inside it, loads wherever Blender does.
// That nothing else of a newer C library is needed is checked on the wheel (tools/engine_wheels.py).
#include <pthread.h>

#define OLD(name) __asm__(".symver old_" #name "," #name "@GLIBC_2.2.5")

extern "C" {

#pragma GCC visibility push(default)
double old_exp(double);
int old_pthread_create(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
int old_pthread_join(pthread_t, void **);
int old_pthread_once(pthread_once_t *, void (*)());
unsigned long old_strtoul(const char *, char **, int);
#pragma GCC visibility pop

OLD(exp);
OLD(pthread_create);
OLD(pthread_join);
OLD(pthread_once);
OLD(strtoul);

#pragma GCC visibility push(hidden)
// The C++ library asks whether it may leave out locks; the oldest C library cannot tell.
extern char __libc_single_threaded;
char __libc_single_threaded = 0;

// under another name, as the compiler knows its own beforehand, as visible
double hidden_exp(double) __asm__("exp");
double hidden_exp(double x) { return old_exp(x); }

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *),
                   void *argument) {
    return old_pthread_create(thread, attributes, run, argument);
}

int pthread_join(pthread_t thread, void **result) { return old_pthread_join(thread, result); }

int pthread_once(pthread_once_t *once, void (*run)()) { return old_pthread_once(once, run); }

// what the headers of 2.38 and later make of strtoul
unsigned long __isoc23_strtoul(const char *text, char **end, int base) {
    return old_strtoul(text, end, base);
}
#pragma GCC visibility pop
}
