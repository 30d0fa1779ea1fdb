/* Preloaded into a process of libstdc++: memory that C++ gave back with its size is never used
 * again, and reads as ones. Who counts down a reference in it finds the last one, and calls a
 * function at an address that is none: the process ends by a signal, in every run, where it
 * otherwise may or may not abort much later. */
#include <stddef.h>
#include <stdint.h>

/* operator delete(void *, std::size_t) by its name in the Itanium C++ ABI. */
void _ZdlPvm(void *block, size_t size);

__attribute__((visibility("default"))) void _ZdlPvm(void *block, size_t size) {
    uint32_t *words = block;
    for (size_t i = 0; block != NULL && i < size / sizeof *words; i++)
        words[i] = 1;
}
