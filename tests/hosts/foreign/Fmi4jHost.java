import java.io.File;
import java.io.PrintWriter;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.Arrays;
import java.util.List;

import no.ntnu.ihb.fmi4j.importer.fmi2.AbstractModelInstance;
import no.ntnu.ihb.fmi4j.importer.fmi2.CoSimulationSlave;
import no.ntnu.ihb.fmi4j.importer.fmi2.Fmu;
import no.ntnu.ihb.fmi4j.importer.fmi2.ModelExchangeInstance;

/**
 * Moves an FMU along a table of inputs: FMU, CS or ME, table, outputs (comma-separated), result.
 * The one continuous state of Model Exchange is integrated by Euler's method.
 */
public class Fmi4jHost {
    private final String[] names;
    private final double[][] table; // rows of time and inputs
    private final String[] outputs;
    private final PrintWriter result;

    private Fmi4jHost(Path table, String outputs, PrintWriter result) throws Exception {
        List<String> lines = Files.readAllLines(table);
        this.names = lines.get(0).split(",");
        this.table = lines.stream().skip(1)
                .map(line -> Arrays.stream(line.split(",")).mapToDouble(Double::parseDouble).toArray())
                .toArray(double[][]::new);
        this.outputs = outputs.split(",");
        this.result = result;
    }

    public static void main(String[] arguments) throws Exception {
        try (var fmu = Fmu.from(new File(arguments[0])); var result = new PrintWriter(arguments[4])) {
            var host = new Fmi4jHost(Path.of(arguments[2]), arguments[3], result);
            if (arguments[1].equals("CS"))
                host.step(fmu.asCoSimulationFmu().newInstance("linkage"));
            else
                host.integrate(fmu.asModelExchangeFmu().newInstance("linkage"));
        }
    }

    private void step(CoSimulationSlave slave) {
        initialize(slave);
        for (int i = 0; i + 1 < table.length; ++i) {
            set(slave, i);
            demand(slave.doStep(table[i][0], table[i + 1][0] - table[i][0]), "the step");
            get(slave, i + 1);
        }
        slave.close();
    }

    private void integrate(ModelExchangeInstance model) {
        double[] state = new double[1], rate = new double[1];
        initialize(model);
        demand(model.newDiscreteStates().isOK() && model.enterContinuousTimeMode().isOK(), "the first event");
        for (int i = 0; i < table.length; ++i) {
            demand(model.setTime(table[i][0]).isOK(), "setting the time");
            demand(model.setContinuousStates(state).isOK(), "setting the state");
            set(model, i);
            get(model, i);
            demand(model.getDerivatives(rate).isOK(), "getting the derivative");
            demand(!model.completedIntegratorStep().getTerminateSimulation(), "the integrator's step");
            if (i + 1 < table.length)
                state[0] += rate[0] * (table[i + 1][0] - table[i][0]);
        }
        model.close();
    }

    private void initialize(AbstractModelInstance<?, ?> instance) {
        demand(instance.setupExperiment(0, 0, 0) && instance.enterInitializationMode()
                && instance.exitInitializationMode(), "initialization");
    }

    private void set(AbstractModelInstance<?, ?> instance, int row) {
        long[] references = references(instance, Arrays.copyOfRange(names, 1, names.length));
        demand(instance.writeReal(references, Arrays.copyOfRange(table[row], 1, names.length)).isOK(), "setting");
    }

    private void get(AbstractModelInstance<?, ?> instance, int row) {
        double[] values = new double[outputs.length];
        demand(instance.readReal(references(instance, outputs), values).isOK(), "getting");
        result.print(table[row][0]);
        for (double value : values)
            result.print("," + value);
        result.println();
    }

    private static long[] references(AbstractModelInstance<?, ?> instance, String[] names) {
        var variables = instance.getModelDescription().getModelVariables();
        return Arrays.stream(names).mapToLong(name -> variables.getByName(name).getValueReference()).toArray();
    }

    private static void demand(boolean holds, String what) {
        if (!holds)
            throw new IllegalStateException("error: " + what + " failed");
    }
}
