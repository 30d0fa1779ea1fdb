/* The loop over the poses of a turn: an instance of an FMU, of FMI 2.0 or 3.0, is placed at one
 * crank angle after the other and asked for its outputs, their derivatives by the crank angle, or
 * the gradient of their weighted sum. turn.py makes a shared library of this file; its instance is
 * in Initialization Mode, where outputs belong to the inputs as set. */
#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* An instance and its functions: those of FMI 2.0, or, where fmi2 is 0, of FMI 3.0. */
typedef struct {
    int64_t fmi2;
    void *instance;
    fmi2SetRealTYPE *set2;
    fmi2GetRealTYPE *get2;
    fmi2GetDirectionalDerivativeTYPE *direct2;
    fmi3SetFloat64TYPE *set3;
    fmi3GetFloat64TYPE *get3;
    fmi3GetDirectionalDerivativeTYPE *direct3;
    fmi3GetAdjointDerivativeTYPE *adjoint3;
    uint64_t outputs, knowns;                  /* how many */
    const uint32_t *output, *known, *angle;    /* value references; one of the crank angle */
} Host;

/* All return 0 where every call was answered with OK, and otherwise the status, with the number of
 * the pose in *at. */

static int place(const Host *host, double phi) {
    return host->fmi2 ? (int)host->set2(host->instance, host->angle, 1, &phi)
                      : (int)host->set3(host->instance, host->angle, 1, &phi, 1);
}

static int get(const Host *host, double values[]) {
    size_t n = (size_t)host->outputs;
    return host->fmi2 ? (int)host->get2(host->instance, host->output, n, values)
                      : (int)host->get3(host->instance, host->output, n, values, n);
}

/* The derivatives of all outputs by one variable. */
static int direct(const Host *host, const uint32_t *by, double rates[]) {
    static const double one = 1.0;
    size_t n = (size_t)host->outputs;
    return host->fmi2
               ? (int)host->direct2(host->instance, host->output, n, by, 1, &one, rates)
               : (int)host->direct3(host->instance, host->output, n, by, 1, &one, 1, rates, n);
}

/* values[k * outputs + i], rates[...]: the i-th output at phi[k] and its derivative by the crank
 * angle. */
EXPORT int turn_sample(const Host *host, size_t poses, const double phi[], double values[],
                       double rates[], size_t *at) {
    for (size_t k = 0; k < poses; ++k) {
        size_t row = k * (size_t)host->outputs;
        *at = k;
        int status = place(host, phi[k]);
        if (status == 0)
            status = get(host, values + row);
        if (status == 0)
            status = direct(host, host->angle, rates + row);
        if (status != 0)
            return status;
    }
    return 0;
}

/* gradients[k * knowns + j]: the derivative, by the j-th known, of the sum of all outputs at
 * phi[k], each times weights[k * outputs + i]. FMI 3.0 answers in one call, backwards; with FMI 2.0
 * there is a call for each known. scratch: as many as there are outputs. */
EXPORT int turn_gradient(const Host *host, size_t poses, const double phi[], const double weights[],
                         double gradients[], double scratch[], size_t *at) {
    size_t outputs = (size_t)host->outputs, knowns = (size_t)host->knowns;
    for (size_t k = 0; k < poses; ++k) {
        const double *weight = weights + k * outputs;
        double *gradient = gradients + k * knowns;
        *at = k;
        int status = k > 0 && phi[k] == phi[k - 1] ? 0 : place(host, phi[k]);
        if (status == 0 && !host->fmi2)
            status = (int)host->adjoint3(host->instance, host->output, outputs, host->known, knowns,
                                         weight, outputs, gradient, knowns);
        for (size_t j = 0; j < knowns && status == 0 && host->fmi2; ++j) {
            status = direct(host, host->known + j, scratch);
            gradient[j] = 0.0;
            for (size_t i = 0; i < outputs; ++i)
                gradient[j] += weight[i] * scratch[i];
        }
        if (status != 0)
            return status;
    }
    return 0;
}
