#include "message.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBER_SIZE = 48 };

/* printf and strtod follow the host's locale, whose decimal point may be a comma and more than
 * one byte long: everything that is not a digit, sign or letter becomes one point. */
static void number_text(double value, bool is_rounded, char text[NUMBER_SIZE]) {
    char local[NUMBER_SIZE];
    for (int digits = 6; digits <= 17; ++digits) {
        snprintf(local, sizeof local, "%.*g", digits, value);
        if (is_rounded || strtod(local, NULL) == value)
            break;
    }
    char *out = text;
    for (const char *in = local; *in != '\0'; ++in) {
        if (strchr("0123456789+-abcdefinxABCDEFINX", *in) != NULL)
            *out++ = *in;
        else if (out == text || out[-1] != '.')
            *out++ = '.';
    }
    *out = '\0';
}

void message_write(char *text, size_t size, const char *format, ...) {
    size_t length = 0;
    va_list arguments;
    va_start(arguments, format);
    for (const char *f = format; *f != '\0' && length + 1 < size; ++f) {
        char piece[NUMBER_SIZE] = {*f, '\0'};
        const char *source = piece;
        if (*f == '%') {
            ++f;
            if (*f == 's')
                source = va_arg(arguments, const char *);
            else if (*f == 'g' || *f == 'G')
                number_text(va_arg(arguments, double), *f == 'G', piece);
            else
                snprintf(piece, sizeof piece, "%u", va_arg(arguments, unsigned));
            if (source == NULL)
                source = "(null)";
        }
        size_t count = strlen(source);
        if (count > size - 1 - length)
            count = size - 1 - length;
        memcpy(text + length, source, count);
        length += count;
    }
    va_end(arguments);
    text[length] = '\0';
}
