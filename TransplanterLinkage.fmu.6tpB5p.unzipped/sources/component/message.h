/* Text for people, the same under every locale. */
#ifndef MESSAGE_H
#define MESSAGE_H

#include <stddef.h>

#ifndef INTERNAL /* see linkage.h */
#define INTERNAL
#endif

#if defined(__GNUC__)
#define MESSAGE_FORMAT(at, first) __attribute__((format(printf, at, first)))
#else
#define MESSAGE_FORMAT(at, first)
#endif

/* Writes a text of at most size - 1 characters. format knows %s (a NULL shows as "(null)"),
 * %u (unsigned) and %g (double: as many of 17 digits as it takes to tell it from its
 * neighbours, with a decimal point), %G (double, 6 digits), nothing else. */
INTERNAL void message_write(char *text, size_t size, const char *format, ...) MESSAGE_FORMAT(3, 4);

#endif
