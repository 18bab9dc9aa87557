/* Saved states: the value block behind a header by which bytes of another FMU, or damaged ones, are known. */
#include <stdlib.h>
#include <string.h>
#include "instance.h"

typedef struct {
    char magic[8];
    unsigned long long layout, size, checksum;
    jl_values values;
} jl_saved;

static const char jl_magic[8] = { 'j', 'l', 's', 't', 'a', 't', 'e', '1' };

/* Fowler, Noll and Vo's hash (FNV-1a, 64 bits). */
static unsigned long long jl_hash(unsigned long long hash, const void *data, size_t size)
{
    const unsigned char *byte = (const unsigned char *)data;
    size_t i;
    for (i = 0; i < size; i++) hash = (hash ^ byte[i]) * 1099511628211ULL;
    return hash;
}

/* The token stands for the joint, the sizes for the compiler, the number for the byte order. */
static unsigned long long jl_layout(void)
{
    const int sizes[] = { JL_VARIABLES, JL_PARAMETERS, JL_STATES,   JL_CONTINUOUS,
                          JL_MODES,     JL_INDICATORS, JL_EXCHANGE, (int)sizeof(jl_values) };
    const double one = 1.0;
    unsigned long long hash = jl_hash(14695981039346656037ULL, jl_token, strlen(jl_token));
    hash = jl_hash(hash, sizes, sizeof sizes);
    return jl_hash(hash, &one, sizeof one);
}

static unsigned long long jl_checksum(const jl_values *values)
{
    return jl_hash(14695981039346656037ULL, values, sizeof *values);
}

/* What is wrong with a saved state, NULL if nothing is. */
static const char *jl_fault(const jl_saved *saved)
{
    if (!saved) return "the saved state is NULL";
    if (memcmp(saved->magic, jl_magic, sizeof jl_magic) != 0 || saved->layout != jl_layout()
        || saved->size != sizeof *saved)
        return "the saved state belongs to another FMU";
    return saved->checksum == jl_checksum(&saved->values) ? NULL : "the saved state is damaged";
}

/* The instance may make the call and, if one is given, the saved state is sound. */
static int jl_ready(jl_instance *instance, jl_call call, const void *saved)
{
    const char *fault;
    if (jl_enter(instance, call)) return JL_ERROR;
    fault = jl_fault((const jl_saved *)saved);
    return fault ? jl_fail(instance, call, "%s", fault) : JL_OK;
}

int jl_save(void *c, jl_call call, void **place)
{
    jl_instance *instance = (jl_instance *)c;
    jl_saved *saved;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (!place) return jl_fail(instance, call, "the place of the saved state is NULL");
    if (*place && jl_fault((jl_saved *)*place))
        return jl_fail(instance, call, "%s, expected NULL or one of this FMU", jl_fault((jl_saved *)*place));
    saved = *place ? (jl_saved *)*place : (jl_saved *)calloc(1, sizeof *saved);
    if (!saved) return jl_fail(instance, call, "there is no memory left");
    memcpy(saved->magic, jl_magic, sizeof jl_magic);
    saved->layout = jl_layout();
    saved->size = sizeof *saved;
    memcpy(&saved->values, &instance->values, sizeof saved->values);
    saved->checksum = jl_checksum(&saved->values);
    *place = saved;
    return JL_OK;
}

int jl_restore(void *c, jl_call call, const void *place)
{
    jl_instance *instance = (jl_instance *)c;
    const jl_saved *saved = (const jl_saved *)place;
    if (jl_ready(instance, call, saved)) return JL_ERROR;
    if (saved->values.exchange != instance->values.exchange)
        return jl_fail(instance, call, "the saved state is one of %s",
                       saved->values.exchange ? "model exchange" : "co-simulation");
    memcpy(&instance->values, &saved->values, sizeof instance->values);
    return JL_OK;
}

int jl_drop(void *c, jl_call call, void **place)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (!place) return jl_fail(instance, call, "the place of the saved state is NULL");
    free(*place);
    *place = NULL;
    return JL_OK;
}

int jl_saved_size(void *c, jl_call call, const void *saved, size_t *size)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_ready(instance, call, saved)) return JL_ERROR;
    if (!size) return jl_fail(instance, call, "the place of the size is NULL");
    *size = sizeof(jl_saved);
    return JL_OK;
}

int jl_serialize(void *c, jl_call call, const void *saved, void *bytes, size_t size)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_ready(instance, call, saved)) return JL_ERROR;
    if (!bytes || size != sizeof(jl_saved))
        return jl_fail(instance, call, "%lu bytes at %s, expected %lu", (unsigned long)size,
                       bytes ? "hand" : "NULL", (unsigned long)sizeof(jl_saved));
    memcpy(bytes, saved, sizeof(jl_saved));
    return JL_OK;
}

int jl_deserialize(void *c, jl_call call, const void *bytes, size_t size, void **place)
{
    jl_instance *instance = (jl_instance *)c;
    jl_saved *saved;
    const char *fault;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (!bytes || !place) return jl_fail(instance, call, "the bytes or the place of the saved state are NULL");
    if (size != sizeof *saved)
        return jl_fail(instance, call, "%lu bytes, expected %lu: the saved state belongs to another FMU",
                       (unsigned long)size, (unsigned long)sizeof *saved);
    saved = (jl_saved *)calloc(1, sizeof *saved);
    if (!saved) return jl_fail(instance, call, "there is no memory left");
    memcpy(saved, bytes, sizeof *saved);
    fault = jl_fault(saved);
    if (fault) {
        free(saved);
        return jl_fail(instance, call, "%s", fault);
    }
    *place = saved;
    return JL_OK;
}
